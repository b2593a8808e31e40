#include "deepuav/matching/late_matcher.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/matching/nearest_neighbour.h"

namespace deepuav {
namespace {

TEST(LateMatcher, IsMadeOnceAndNotBeforeItIsAsked) {
  int made = 0;
  LateMatcher late([&] {
    ++made;
    return std::make_unique<NearestNeighbourMatcher>(NearestNeighbourOptions{});
  });
  EXPECT_EQ(late.Description(), "not asked");
  EXPECT_EQ(made, 0);
  const Features none{{}, Descriptors(4)};
  EXPECT_TRUE(late.MatchFeatures(none, none).empty());
  EXPECT_TRUE(late.MatchFeatures(none, none).empty());
  EXPECT_EQ(made, 1);
  EXPECT_EQ(late.Description(), NearestNeighbourMatcher({}).Description());
}

TEST(LateMatcher, SaysWhatIsWrongWithItsFileWhenItIsAsked) {
  LateMatcher late([]() -> std::unique_ptr<Matcher> { throw Error("net.onnx: is empty"); });
  const Features none{{}, Descriptors(4)};
  EXPECT_THROW(late.MatchFeatures(none, none), Error);
}

}  // namespace
}  // namespace deepuav
