#include <gtest/gtest.h>

#include <limits>

#include "deepuav/autopilot/clock_sync.h"
#include "deepuav/autopilot/steady_image_clock.h"

namespace deepuav {
namespace {

constexpr int64_t kMs = 1'000'000, kSecond = 1000 * kMs;

TEST(ClockSync, FindsTheAutopilotsClock) {
  ClockSync clock;
  int64_t now = 1000 * kSecond;
  const int64_t offset = -987 * kSecond;
  EXPECT_EQ(clock.TimeOf(now), now);
  for (int i = 0; i < 30; ++i, now += kSecond) {
    const int64_t out = (1 + 7 * (i % 3)) * kMs, back = (1 + 5 * (i % 2)) * kMs;
    const int64_t mark = clock.Ask(now);
    clock.Answer(now + out + offset, mark, now + out + back);
  }
  ASSERT_TRUE(clock.is_known());
  EXPECT_NEAR(static_cast<double>(clock.TimeOf(now) - now - offset), 0, 2.0 * kMs);
}

TEST(ClockSync, LeavesAsideWhatAnswersNothing) {
  ClockSync clock;
  const int64_t now = 1000 * kSecond, mark = clock.Ask(now);
  clock.Answer(5 * kSecond, mark + 1, now + kMs);                // No question of ours.
  clock.Answer(5 * kSecond, clock.Ask(now + 1), now + kSecond);  // Late.
  clock.Answer(-5, clock.Ask(now + 2), now + kMs);               // No clock.
  clock.Answer(std::numeric_limits<int64_t>::max(), clock.Ask(now + 3), now + kMs);
  clock.Answer(std::numeric_limits<int64_t>::min(), std::numeric_limits<int64_t>::min(), now);
  EXPECT_FALSE(clock.is_known());
  clock.Answer(5 * kSecond, mark, now + 2 * kMs);
  ASSERT_TRUE(clock.is_known());
  const int64_t time = clock.TimeOf(now);
  clock.Answer(7 * kSecond, mark, now + 3 * kMs);  // The same question again.
  EXPECT_EQ(clock.TimeOf(now), time);
}

TEST(ClockSync, WaitsForAFasterAnswerThanASlowFirstOne) {
  constexpr int64_t kOffset = 500 * kSecond;
  int64_t now = 1000 * kSecond;
  ClockSync clock, slow;
  const auto answer = [&now](int64_t out, ClockSync* of) {
    now += 100 * kMs;
    of->Answer(now + out + kOffset, of->Ask(now), now + out);
  };
  answer(180 * kMs, &clock);
  EXPECT_FALSE(clock.is_known());
  answer(2 * kMs, &clock);
  ASSERT_TRUE(clock.is_known());
  EXPECT_EQ(clock.TimeOf(now), now + kOffset + kMs);
  for (const int64_t out : {190, 150, 180, 170}) answer(out * kMs, &slow);
  EXPECT_FALSE(slow.is_known());
  answer(195 * kMs, &slow);
  ASSERT_TRUE(slow.is_known()) << "no faster one comes";
  EXPECT_EQ(slow.TimeOf(now), now + kOffset + 75 * kMs);
  const int64_t before = slow.TimeOf(now) - now;
  for (int i = 0; i < 3; ++i) {
    now += kSecond;
    slow.Answer(now, slow.Ask(now), now + 180 * kMs);
  }
  EXPECT_TRUE(slow.is_known());
  EXPECT_LT(slow.TimeOf(now) - now, before - 400 * kSecond) << "an autopilot that began anew";
}

TEST(ClockSync, FollowsAnAutopilotThatBeginsAnewAndNoSingleOutlier) {
  ClockSync clock;
  int64_t now = 1000 * kSecond;
  const auto answer = [&](int64_t autopilot_ns) {
    now += kSecond;
    clock.Answer(autopilot_ns, clock.Ask(now), now);
    return clock.TimeOf(now);
  };
  EXPECT_EQ(answer(500 * kSecond), 500 * kSecond);
  EXPECT_EQ(answer(100 * kSecond), 501 * kSecond);
  EXPECT_EQ(answer(502 * kSecond), 502 * kSecond);
  EXPECT_EQ(answer(1 * kSecond), 503 * kSecond);
  EXPECT_EQ(answer(2 * kSecond), 504 * kSecond);
  EXPECT_EQ(answer(3 * kSecond), 3 * kSecond);
}

TEST(SteadyImageClock, IsThatOfTheImagesThatCameFastest) {
  SteadyImageClock clock;
  EXPECT_FALSE(clock.SteadyOf(Timestamp{0}));
  for (int i = 0; i < 100; ++i)
    clock.Arrived(Timestamp{50 * kMs * i}, 7 * kSecond + 50 * kMs * i + kMs * (i % 10));
  EXPECT_EQ(clock.SteadyOf(Timestamp{5 * kSecond}), 7 * kSecond + 5 * kSecond);
  // Another clock.
  clock.Arrived(Timestamp{3600 * kSecond}, 20 * kSecond);
  EXPECT_EQ(clock.SteadyOf(Timestamp{3601 * kSecond}), 21 * kSecond);
}

TEST(SteadyImageClock, AMachineThatIsHeldUpForSecondsDoesNotMoveALongMemory) {
  SteadyImageClock clock(600, 10);
  for (int i = 0; i < 300; ++i) {
    const int64_t delay = i < 20 ? kMs * (i % 3) : kMs * (200 + 1500 * (i % 2));
    clock.Arrived(Timestamp{50 * kMs * i}, 7 * kSecond + 50 * kMs * i + delay);
  }
  EXPECT_EQ(clock.offset_ns(), 7 * kSecond);
  clock.Arrived(Timestamp{3600 * kSecond}, 20 * kSecond);
  EXPECT_EQ(clock.offset_ns(), -3580 * kSecond) << "another clock";
}

}  // namespace
}  // namespace deepuav
