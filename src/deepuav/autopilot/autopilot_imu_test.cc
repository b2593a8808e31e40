#include "deepuav/autopilot/autopilot_imu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr int64_t kMs = 1'000'000, kSecond = 1000 * kMs, kStart = 100 * kSecond;

AutopilotImuOptions Wanted() {
  AutopilotImuOptions options;
  options.wanted = true;
  return options;
}

/// An autopilot whose clock is off the machine's, and what is made of its samples.
class AutopilotImuTest : public testing::Test {
 protected:
  void FindClock() {
    for (int i = 0; i < 3; ++i) clock_.Answer(now_ + offset_, clock_.Ask(now_), now_);
  }
  InertialMessage Message(int64_t time_ns) const {
    InertialMessage message;
    message.is_highres = true;
    message.time_us = (time_ns + offset_) / 1000;
    message.angular_velocity = {0.1, 0.2, 0.3};
    message.specific_force = {0, 0, -9.8};
    return message;
  }
  std::optional<ImuSample> Take(const InertialMessage& message) {
    const std::optional<ImuSample> sample = imu_->Take(message, clock_, now_);
    if (sample) {
      EXPECT_GT(sample->time, last_.value_or(Timestamp{0})) << "times grow";
      last_ = sample->time;
    }
    return sample;
  }
  /// How many samples are taken of so many seconds of them, 2 ms old.
  int Fly(double seconds, double rate_hz = 200, bool is_highres = true) {
    int taken = 0;
    const auto step_ns = static_cast<int64_t>(1e9 / rate_hz);
    for (const int64_t end = now_ + std::llround(seconds * kSecond); now_ < end; now_ += step_ns) {
      InertialMessage message = Message(now_ - 2 * kMs);
      message.is_highres = is_highres;
      taken += Take(message) ? 1 : 0;
      Step();
    }
    return taken;
  }
  void Wait(double seconds) {
    for (const int64_t end = now_ + std::llround(seconds * kSecond); now_ < end; now_ += 25 * kMs)
      Step();
  }
  void Step() {
    const AutopilotImu::Ask ask = imu_->DueAsk(now_);
    if (ask.highres) highres_asks_.push_back(now_);
    if (ask.scaled) scaled_asks_.push_back(now_);
    if (const auto news = imu_->DueNews(now_)) news_.push_back(news->text + ": " + news->why);
  }

  int64_t now_ = kStart, offset_ = -70 * kSecond;
  ClockSync clock_;
  std::optional<AutopilotImu> imu_{std::in_place, Wanted()};
  std::optional<Timestamp> last_;
  std::vector<int64_t> highres_asks_, scaled_asks_;
  std::vector<std::string> news_;
};

TEST_F(AutopilotImuTest, SamplesAreBroughtOnTheMachinesClock) {
  FindClock();
  const auto sample = Take(Message(now_ - 3 * kMs));
  ASSERT_TRUE(sample);
  EXPECT_NEAR(static_cast<double>(sample->time.nanoseconds), now_ - 3.0 * kMs, 1e3);
  EXPECT_EQ(sample->angular_velocity, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(sample->specific_force, Eigen::Vector3d(0, 0, -9.8));
}

TEST_F(AutopilotImuTest, NothingIsTakenBeforeTheClockIsKnown) {
  EXPECT_EQ(Fly(1), 0);
  EXPECT_EQ(imu_->left_aside().before_clock, 200);
  FindClock();
  EXPECT_EQ(Fly(1), 200);
}

TEST_F(AutopilotImuTest, AClockThatIsCorrectedDoesNotJerkTheSamples) {
  FindClock();
  ASSERT_TRUE(Take(Message(now_)));
  int64_t before = last_->nanoseconds;
  for (int i = 1; i <= 4000; ++i) {
    now_ += 5 * kMs;
    // Found 9 ms otherwise, by answers that came faster: a millisecond more each second.
    if (i % 200 == 0) clock_.Answer(now_ + offset_ + 9 * kMs, clock_.Ask(now_), now_);
    ASSERT_TRUE(Take(Message(now_)));
    EXPECT_NEAR(static_cast<double>(last_->nanoseconds - before), 5.0 * kMs, 7e3) << i;
    before = last_->nanoseconds;
  }
  EXPECT_NEAR(static_cast<double>(now_ - last_->nanoseconds), 9.0 * kMs, 0.1 * kMs);
}

TEST_F(AutopilotImuTest, AnAutopilotThatBeginsAnewGoesOnWithTimesThatGrow) {
  FindClock();
  EXPECT_EQ(Fly(1), 200);
  offset_ = -(now_ - kSecond);  // Its clock begins at 1 s.
  EXPECT_EQ(Fly(1), 0) << "the clock is not that which was found";
  EXPECT_EQ(imu_->left_aside().out_of_time, 200);
  FindClock();
  EXPECT_EQ(Fly(1), 200);
  offset_ = 5000 * kSecond;
  FindClock();
  EXPECT_EQ(Fly(1), 200);
}

TEST_F(AutopilotImuTest, WhatNoSensorMeasuresIsLeftAside) {
  FindClock();
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  for (const double value : {nan, infinity, -infinity, 1e6, -201.0}) {
    InertialMessage message = Message(now_);
    message.specific_force.y() = value;
    EXPECT_FALSE(Take(message));
    message = Message(now_);
    message.angular_velocity.z() = value;
    EXPECT_FALSE(Take(message));
  }
  InertialMessage stale = Message(now_);
  stale.is_measured = false;
  EXPECT_FALSE(Take(stale));
  EXPECT_EQ(imu_->left_aside().implausible, 11);
  EXPECT_TRUE(Take(Message(now_)));
}

TEST_F(AutopilotImuTest, TimesThatCannotBeAreLeftAside) {
  FindClock();
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
  for (const int64_t time_us : {int64_t{0}, int64_t{-5}, kMost, kMost / 1000, -kMost}) {
    InertialMessage message = Message(now_);
    message.time_us = time_us;
    EXPECT_FALSE(Take(message));
  }
  EXPECT_FALSE(Take(Message(now_ - 2 * kSecond)));
  EXPECT_FALSE(Take(Message(now_ + kSecond)));
  EXPECT_TRUE(Take(Message(now_)));
  EXPECT_FALSE(Take(Message(now_))) << "the same again";
  EXPECT_FALSE(Take(Message(now_ - kMs)));
  EXPECT_FALSE(Take(Message(now_ + kMs / 10))) << "a flood";
  EXPECT_EQ(imu_->left_aside().out_of_time, 10);
}

TEST_F(AutopilotImuTest, OneSensorIsHeardAndTheFineMessageWins) {
  FindClock();
  EXPECT_EQ(Fly(1, 200, false), 200) << "where only the coarse one comes";
  InertialMessage message = Message(now_);
  message.sensor = 2;
  EXPECT_TRUE(Take(message));
  now_ += 5 * kMs;
  EXPECT_FALSE(Take(Message(now_))) << "another sensor";
  message = Message(now_);
  message.is_highres = false;
  EXPECT_FALSE(Take(message));
  EXPECT_EQ(imu_->left_aside().other_sensor, 2);
  now_ += 3 * kSecond;
  message = Message(now_);
  message.is_highres = false;
  EXPECT_TRUE(Take(message)) << "the fine one stopped";
}

TEST_F(AutopilotImuTest, ItIsAskedUntilEnoughComes) {
  FindClock();
  Wait(6);
  EXPECT_EQ(highres_asks_.size(), 3u) << "with pauses that grow";
  EXPECT_TRUE(scaled_asks_.empty());
  Wait(600);
  EXPECT_LT(highres_asks_.size(), 30u);
  EXPECT_EQ(scaled_asks_.size(), highres_asks_.size() - 3) << "the coarse one, too, then";
  Fly(35, 50);
  const size_t asks = highres_asks_.size(), scaled_asks = scaled_asks_.size();
  Fly(35, 50);
  EXPECT_GT(highres_asks_.size(), asks) << "at 50 Hz by itself";
  EXPECT_EQ(scaled_asks_.size(), scaled_asks);
  Fly(35);
  const size_t enough = highres_asks_.size();
  Fly(60);
  EXPECT_EQ(highres_asks_.size(), enough);
  Wait(2);
  EXPECT_GT(highres_asks_.size(), enough) << "it stopped";
}

TEST_F(AutopilotImuTest, ThePausesBetweenQuestionsAreAsTheOptionsSay) {
  AutopilotImuOptions options = Wanted();
  options.first_pause_s = 2;
  options.longest_pause_s = 4;
  options.asks_for_highres_alone = 1;
  imu_.emplace(options);
  Wait(11);
  const std::vector<int64_t> expected = {now_ - 11 * kSecond, now_ - 9 * kSecond,
                                         now_ - 5 * kSecond, now_ - kSecond};
  EXPECT_EQ(highres_asks_, expected);
  EXPECT_EQ(scaled_asks_, std::vector<int64_t>(expected.begin() + 1, expected.end()));
}

TEST_F(AutopilotImuTest, AnAutopilotThatBeganAnewIsAskedAtOnce) {
  FindClock();
  Wait(60);
  const size_t asks = highres_asks_.size();
  imu_->Restart();
  Wait(0.1);
  EXPECT_EQ(highres_asks_.size(), asks + 1);
}

TEST_F(AutopilotImuTest, WhatChangesIsToldOnce) {
  FindClock();
  Fly(10);
  ASSERT_EQ(news_.size(), 1u);
  EXPECT_EQ(news_[0], "SLAM: inertial samples of the autopilot at 200 Hz: HIGHRES_IMU");
  Wait(10);
  ASSERT_EQ(news_.size(), 2u);
  EXPECT_NE(news_[1].find("stopped"), std::string::npos);
  Fly(10, 100, false);
  ASSERT_EQ(news_.size(), 3u);
  EXPECT_NE(news_[2].find("at 100 Hz"), std::string::npos) << news_[2];
}

TEST_F(AutopilotImuTest, ThatNoneComeIsToldOnceWithTheReason) {
  Wait(60);
  ASSERT_EQ(news_.size(), 1u);
  EXPECT_NE(news_[0].find("none came"), std::string::npos);
  imu_.emplace(Wanted());
  Fly(60);
  ASSERT_EQ(news_.size(), 2u);
  EXPECT_NE(news_[1].find("clock is not known"), std::string::npos);
}

TEST_F(AutopilotImuTest, GarbageDoesNoHarm) {
  FindClock();
  Random random(3);
  const auto any = [&random] { return std::pow(10, random.Index(80) - 40) * random.Gaussian(1); };
  for (int i = 0; i < 20'000; ++i, now_ += 5 * kMs) {
    if (i % 200 == 0) FindClock();
    InertialMessage message = Message(now_ + std::llround(std::fmod(1e9 * any(), 1e9)));
    message.is_highres = random.Index(2) == 0;
    message.sensor = random.Index(3);
    if (random.Index(2) == 0) message.time_us = std::llround(std::fmod(any(), 1e18));
    message.angular_velocity *= any();
    message.specific_force *= any();
    Take(message);
    Step();
  }
  now_ += kSecond;
  FindClock();
  imu_->Restart();
  EXPECT_EQ(Fly(1), 200);
}

TEST(AutopilotImuOptions, AreChecked) {
  AutopilotImuOptions slow, open;
  slow.rate_hz = 1;
  open.max_specific_force = 0;
  EXPECT_THROW(CheckOptions("", slow), Error);
  EXPECT_THROW(CheckOptions("", open), Error);
  AutopilotImuOptions hurried;
  hurried.longest_pause_s = hurried.first_pause_s / 2;
  EXPECT_THROW(CheckOptions("", hurried), Error);
}

TEST(GentleOffset, FollowsSlowlyAndTakesAnotherClockAtOnce) {
  GentleOffset offset;
  EXPECT_EQ(offset.Towards(7 * kSecond, 0), 7 * kSecond);
  EXPECT_EQ(offset.Towards(7 * kSecond + 10 * kMs, kSecond), 7 * kSecond + kMs);
  EXPECT_EQ(offset.Towards(7 * kSecond + 10 * kMs, 20 * kSecond), 7 * kSecond + 10 * kMs);
  EXPECT_EQ(offset.Towards(7 * kSecond, 19 * kSecond), 7 * kSecond + 10 * kMs) << "time went back";
  EXPECT_EQ(offset.Towards(-3 * kSecond, 21 * kSecond), -3 * kSecond);
}

}  // namespace
}  // namespace deepuav
