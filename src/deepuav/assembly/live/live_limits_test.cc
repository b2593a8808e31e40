#include "deepuav/assembly/live/live_limits.h"

#include <gmock/gmock.h>

namespace deepuav {
namespace {

TEST(LiveLimits, BoundTheFramesThatTheOptionsLeaveOpen) {
  SystemOptions open;
  BoundRecords(&open);
  EXPECT_EQ(open.max_records, 10'000);
  EXPECT_EQ(open.full_record_frames, 1000);
  SystemOptions said;
  said.max_records = 200;
  said.full_record_frames = 7;
  BoundRecords(&said);
  EXPECT_EQ(said.max_records, 200);
  EXPECT_EQ(said.full_record_frames, 7);
}

TEST(LiveLimits, OfSamplesTheLatestStay) {
  std::vector<int> samples;
  for (int i = 0; i < 1000; ++i) {
    samples.push_back(i);
    ForgetOldest(10, &samples);
    ASSERT_LE(samples.size(), 15u);
    ASSERT_EQ(samples.back(), i);
    ASSERT_EQ(samples.front(), i + 1 - static_cast<int>(samples.size()));
  }
  EXPECT_GE(samples.size(), 10u);
  ForgetOldest(0, &samples);
  EXPECT_GE(samples.size(), 10u);
}

}  // namespace
}  // namespace deepuav
