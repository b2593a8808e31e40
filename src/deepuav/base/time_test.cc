#include "deepuav/base/time.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

TEST(Timestamp, ConvertsToSeconds) { EXPECT_DOUBLE_EQ(Timestamp{1'500'000'000}.seconds(), 1.5); }

TEST(Timestamp, Orders) { EXPECT_LT(Timestamp{1}, Timestamp{2}); }

// One nanosecond is lost where stamps of today are first turned into seconds.
TEST(SecondsBetween, IsExactForTodaysStamps) {
  const Timestamp from{1'403'636'584'763'555'584}, to{1'403'636'584'763'555'585};
  EXPECT_DOUBLE_EQ(SecondsBetween(from, to), 1e-9);
  EXPECT_DOUBLE_EQ(SecondsBetween(to, from), -1e-9);
}

TEST(Stopwatch, NeverRunsBackwards) {
  const Stopwatch watch;
  double last = 0;
  for (int i = 0; i < 1000; ++i) {
    const double now = watch.Seconds();
    ASSERT_GE(now, last);
    last = now;
  }
}

}  // namespace
}  // namespace deepuav
