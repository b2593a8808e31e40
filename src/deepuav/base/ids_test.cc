#include "deepuav/base/ids.h"

#include <gtest/gtest.h>

#include <set>
#include <type_traits>
#include <unordered_set>

namespace deepuav {
namespace {

static_assert(!std::is_convertible_v<FrameId, KeyframeId>);
static_assert(!std::is_convertible_v<LandmarkId, int64_t>);

TEST(Id, IsInvalidUntilGiven) {
  EXPECT_FALSE(KeyframeId().valid());
  EXPECT_TRUE(KeyframeId{0}.valid());
}

TEST(Id, OrdersByValue) {
  const std::set<LandmarkId> ids{{7}, {-1}, {3}, {7}};
  EXPECT_EQ(std::vector<LandmarkId>(ids.begin(), ids.end()),
            (std::vector<LandmarkId>{{-1}, {3}, {7}}));
}

TEST(Id, Hashes) {
  std::unordered_set<MapId> ids;
  for (int64_t i = 0; i < 100; ++i) ids.insert({i % 10});
  EXPECT_EQ(ids.size(), 10u);
}

}  // namespace
}  // namespace deepuav
