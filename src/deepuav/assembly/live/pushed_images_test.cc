#include "deepuav/assembly/live/pushed_images.h"

#include <gmock/gmock.h>

#include <future>

#include "deepuav/base/error.h"
#include "deepuav/inertial/camera_turns.h"

namespace deepuav {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr double kReadoutSeconds = 0.02;

Camera RollingCamera() {
  Camera camera;
  camera.width = camera.height = 8;
  camera.pinhole = {8, 8, 3.5, 3.5};
  camera.readout_s = kReadoutSeconds;
  return camera;
}

ImuSample SampleAt(int64_t ms) {
  return {{ms * kMs}, {0.001 * static_cast<double>(ms % 7), 0.3, -0.1}, {0, 0, 9.81}};
}

GreyImage SomeImage() { return GreyImage::zeros(8, 8); }

PushedImages WithTurns(size_t capacity, bool newest_only = false) {
  return {RollingCamera(), {}, {capacity, newest_only, true, 0.1}};
}

TEST(PushedImages, ComeInOrderAndEnd) {
  PushedImages images(RollingCamera(), {}, {});
  EXPECT_TRUE(images.Push(SomeImage(), {1}, 0));
  EXPECT_TRUE(images.Push(SomeImage(), {2}, 0));
  images.Close();
  EXPECT_FALSE(images.Push(SomeImage(), {3}, 0));
  EXPECT_EQ(images.Next()->id.value, 0);
  EXPECT_EQ(images.Next()->time.nanoseconds, 2);
  EXPECT_FALSE(images.Next());
  EXPECT_EQ(images.pushed(), 2);
}

TEST(PushedImages, RefuseTimesThatDoNotGrow) {
  PushedImages images(RollingCamera(), {}, {});
  images.Push(SomeImage(), {5}, 0);
  EXPECT_THROW(images.Push(SomeImage(), {5}, 0), Error);
  images.PushImu(SampleAt(1));
  EXPECT_THROW(images.PushImu(SampleAt(1)), Error);
  ImuSample broken = SampleAt(2);
  broken.angular_velocity.x() = std::nan("");
  EXPECT_THROW(images.PushImu(broken), Error);
}

TEST(PushedImages, WaitForRoom) {
  PushedImages images(RollingCamera(), {}, {.capacity = 1});
  images.Push(SomeImage(), {1}, 0);
  auto second = std::async(std::launch::async, [&] { return images.Push(SomeImage(), {2}, 0); });
  EXPECT_EQ(images.Next()->time.nanoseconds, 1);
  EXPECT_TRUE(second.get());
  auto third = std::async(std::launch::async, [&] { return images.Push(SomeImage(), {3}, 0); });
  images.Abandon();
  EXPECT_FALSE(third.get());
  EXPECT_FALSE(images.Next());
}

TEST(PushedImages, TurnAsAllSamplesTell) {
  PushedImages images = WithTurns(4);
  ImuStream all;
  for (int64_t ms = 0; ms < 400; ms += 3) all.samples.push_back(SampleAt(ms));
  const CameraTurns turns(all, 0.1, RollingCamera());
  size_t next = 0;
  std::optional<Timestamp> before;
  for (int64_t ms : {0, 4, 33, 66, 100, 390, 395}) {
    images.Push(SomeImage(), {ms * kMs}, 0);
    for (; next < all.samples.size() && all.samples[next].time.nanoseconds < (ms + 14) * kMs;
         ++next)
      images.PushImu(all.samples[next]);
    if (next == all.samples.size()) images.Close();
    const auto image = images.Next();
    ASSERT_TRUE(image);
    const auto in_readout = turns.DuringReadout(image->time);
    ASSERT_EQ(image->turn_in_readout.has_value(), in_readout.has_value()) << ms;
    if (in_readout) {
      EXPECT_TRUE(image->turn_in_readout->TurnsAs(*in_readout)) << ms;
    }
    const auto since_before = before ? turns.Between(*before, image->time) : std::nullopt;
    ASSERT_EQ(image->turn_since_before.has_value(), since_before.has_value()) << ms;
    if (since_before) {
      EXPECT_EQ(image->turn_since_before->coeffs(), since_before->coeffs()) << ms;
    }
    before = image->time;
    if (next == all.samples.size()) break;
  }
}

TEST(PushedImages, WaitForTheSamplesOfTheirReadout) {
  PushedImages images = WithTurns(4);
  images.PushImu(SampleAt(80));
  images.Push(SomeImage(), {100 * kMs}, 0);
  auto taken = std::async(std::launch::async, [&] { return images.Next(); });
  images.PushImu(SampleAt(105));
  EXPECT_EQ(taken.wait_for(std::chrono::milliseconds(30)), std::future_status::timeout);
  images.PushImu(SampleAt(110));
  EXPECT_TRUE(taken.get()->turn_in_readout);
}

TEST(PushedImages, GoWithoutSamplesWhereTheQueueIsFull) {
  PushedImages images = WithTurns(2);
  auto taken = std::async(std::launch::async, [&] { return images.Next(); });
  for (int64_t ms : {100, 133, 166}) images.Push(SomeImage(), {ms * kMs}, 0);
  const auto first = taken.get();
  EXPECT_EQ(first->id.value, 0);
  EXPECT_FALSE(first->turn_in_readout);
  auto second = std::async(std::launch::async, [&] { return images.Next(); });
  EXPECT_EQ(second.wait_for(std::chrono::milliseconds(30)), std::future_status::timeout);
  images.Close();
  EXPECT_EQ(second.get()->id.value, 1);
}

TEST(PushedImages, ReadAtOnceDoNotWaitForASensorThatIsSilent) {
  PushedImages images(Camera(), {}, {.with_turns = true, .max_imu_gap_s = 0.1});
  images.Push(SomeImage(), {100 * kMs}, 0);
  EXPECT_EQ(images.Next()->id.value, 0) << "no sample ever came";
  images.PushImu(SampleAt(90));
  images.PushImu(SampleAt(130));
  images.Push(SomeImage(), {133 * kMs}, 0);
  auto taken = std::async(std::launch::async, [&] { return images.Next(); });
  EXPECT_EQ(taken.wait_for(std::chrono::milliseconds(30)), std::future_status::timeout);
  images.PushImu(SampleAt(135));
  EXPECT_TRUE(taken.get()->turn_since_before);
  images.Push(SomeImage(), {1200 * kMs}, 0);
  EXPECT_FALSE(images.Next()->turn_since_before);
}

TEST(PushedImages, WaitNoLongerForSamplesThanAllowed) {
  PushedImages images(RollingCamera(), {},
                      {.newest_only = true, .with_turns = true, .max_wait_s = 0.05});
  for (int64_t ms : {100, 200, 300}) {
    images.PushImu(SampleAt(ms - 40));
    images.Push(SomeImage(), {ms * kMs}, 0);
    const Stopwatch waited;
    const auto image = images.Next();
    ASSERT_TRUE(image);
    EXPECT_FALSE(image->turn_in_readout);
    EXPECT_GT(waited.Seconds(), 0.02);
  }
  EXPECT_EQ(images.skipped(), 0);
  images.Push(SomeImage(), {400 * kMs}, 0);
  images.PushImu(SampleAt(420));
  EXPECT_TRUE(images.Next());
}

TEST(PushedImages, OfSamplesTheLatestAreKept) {
  constexpr int64_t kCount = 100'000;
  ImuStream sensor;
  sensor.source = "sensor";
  PushedImages images(Camera(), sensor, {.kept_samples = 1000});
  for (int64_t ms = 1; ms <= kCount; ++ms) images.PushImu(SampleAt(ms));
  images.Close();
  const ImuStream imu = images.TakeImu();
  EXPECT_EQ(imu.source, "sensor");
  ASSERT_GE(imu.samples.size(), 1000u);
  EXPECT_LE(imu.samples.size(), 1500u);
  EXPECT_EQ(imu.samples.back().time.nanoseconds, kCount * kMs);
  EXPECT_EQ(imu.samples.front().time.nanoseconds,
            (kCount + 1 - static_cast<int64_t>(imu.samples.size())) * kMs);
}

TEST(PushedImages, LiveTheNewestWins) {
  PushedImages images(RollingCamera(), {}, {.newest_only = true});
  for (int64_t time : {1, 2, 3}) images.Push(SomeImage(), {time}, 0);
  EXPECT_EQ(images.Next()->id.value, 2);
  EXPECT_EQ(images.skipped(), 2);
  EXPECT_TRUE(images.KeepsPace());
}

TEST(PushedImages, LiveNoneWaitsForSamplesForEver) {
  PushedImages images = WithTurns(1, true);
  images.Push(SomeImage(), {1 * kMs}, 0);
  images.Push(SomeImage(), {40 * kMs}, 0);
  EXPECT_EQ(images.Next()->id.value, 1);
}

}  // namespace
}  // namespace deepuav
