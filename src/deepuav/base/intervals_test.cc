#include "deepuav/base/intervals.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

struct Tick {
  Timestamp time;
};

std::vector<Tick> Ticks(const std::vector<int64_t>& seconds) {
  std::vector<Tick> ticks;
  for (const int64_t s : seconds) ticks.push_back({{s * 1000000000}});
  return ticks;
}

TEST(MedianInterval, IsNotMovedByAGap) {
  EXPECT_DOUBLE_EQ(MedianInterval_s(Ticks({0, 2, 4, 6, 1000, 1002})), 2);
  EXPECT_DOUBLE_EQ(MedianInterval_s(Ticks({0, 1, 4})), 3);
}

TEST(MedianInterval, OfFewerThanTwoIsNone) {
  EXPECT_EQ(MedianInterval_s(Ticks({})), 0);
  EXPECT_EQ(MedianInterval_s(Ticks({5})), 0);
}

}  // namespace
}  // namespace deepuav
