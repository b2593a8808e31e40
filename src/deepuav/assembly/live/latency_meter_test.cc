#include "deepuav/assembly/live/latency_meter.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

TEST(LatencyMeter, IsOfTheFramesThatWereDone) {
  LatencyMeter meter;
  EXPECT_EQ(meter.All().count, 0);
  const Stopwatch arrival;
  for (int64_t time : {1, 2, 3}) meter.Arrived({time}, arrival);
  meter.Done({2});  // 1 was overtaken.
  meter.Done({2});
  meter.Done({9});
  EXPECT_EQ(meter.All().count, 1);
  EXPECT_GE(meter.All().median_s, 0);
  EXPECT_LE(meter.All().p95_s, arrival.Seconds());
}

TEST(LatencyMeter, GivesTheLatest) {
  LatencyMeter meter;
  for (int64_t time = 0; time < 100; ++time) {
    meter.Arrived({time}, Stopwatch());
    meter.Done({time});
  }
  EXPECT_EQ(meter.All().count, 100);
  EXPECT_EQ(meter.Latest(7).count, 7);
  EXPECT_LE(meter.All().median_s, meter.All().p95_s);
}

}  // namespace
}  // namespace deepuav
