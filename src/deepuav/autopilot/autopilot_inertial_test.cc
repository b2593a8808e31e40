// An autopilot's inertial samples as they come in datagrams.
#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/autopilot/testing/session_fixture.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

struct Sender {
  uint8_t system = kVehicle, component = MAV_COMP_ID_AUTOPILOT1;
};

std::string HighresFrom(const Sender& sender, int64_t time_us, uint16_t fields = 0x1fff) {
  mavlink_status_t status = {};
  mavlink_message_t message = {};
  mavlink_highres_imu_t imu = {};
  imu.time_usec = static_cast<uint64_t>(time_us);
  imu.xacc = 1, imu.yacc = 2, imu.zacc = -9.5F;
  imu.xgyro = 0.1F, imu.ygyro = 0.2F, imu.zgyro = 0.3F;
  imu.fields_updated = fields;
  mavlink_msg_highres_imu_encode_status(sender.system, sender.component, &status, &message, &imu);
  return Bytes(message);
}

std::string ScaledFrom(const Sender& sender, uint32_t time_ms) {
  mavlink_status_t status = {};
  mavlink_message_t message = {};
  mavlink_scaled_imu_t imu = {};
  imu.time_boot_ms = time_ms;
  imu.xacc = 100, imu.yacc = -200, imu.zacc = -1000;
  imu.xgyro = 10, imu.ygyro = -20, imu.zgyro = 3000;
  mavlink_msg_scaled_imu_encode_status(sender.system, sender.component, &status, &message, &imu);
  return Bytes(message);
}

class AutopilotInertialTest : public SessionFixture {
 protected:
  AutopilotInertialTest() { session_.emplace(Wanted(), kStart, Kept()); }

  static AutopilotOptions Wanted() {
    AutopilotOptions options;
    options.imu.wanted = true;
    return options;
  }

  std::vector<ImuSample> samples_;
  AutopilotListener Kept() {
    return {.inertial = [this](const ImuSample& sample) { samples_.push_back(sample); }};
  }
};

TEST_F(AutopilotInertialTest, HighresIsReadInItsUnits) {
  Meet();
  Hear(HighresFrom({}, AutopilotUs()));
  ASSERT_EQ(samples_.size(), 1u);
  EXPECT_EQ(samples_[0].time.nanoseconds, now_);
  EXPECT_TRUE(samples_[0].specific_force.isApprox(Eigen::Vector3d(1, 2, -9.5), 1e-6));
  EXPECT_TRUE(samples_[0].angular_velocity.isApprox(Eigen::Vector3d(0.1, 0.2, 0.3), 1e-6));
}

TEST_F(AutopilotInertialTest, ScaledIsReadInItsUnits) {
  Meet();
  Hear(ScaledFrom({}, static_cast<uint32_t>(AutopilotUs() / 1000)));
  ASSERT_EQ(samples_.size(), 1u);
  EXPECT_EQ(samples_[0].time.nanoseconds, now_);
  EXPECT_TRUE(samples_[0].specific_force.isApprox(9.80665 * Eigen::Vector3d(0.1, -0.2, -1), 1e-9));
  EXPECT_TRUE(samples_[0].angular_velocity.isApprox(Eigen::Vector3d(0.01, -0.02, 3), 1e-9));
}

TEST_F(AutopilotInertialTest, OnlyTheAutopilotsOwnAreTaken) {
  Hear(HighresFrom({}, AutopilotUs()));
  EXPECT_TRUE(samples_.empty()) << "nobody was heard";
  Meet();
  Hear(HighresFrom({kOther}, AutopilotUs()));
  Hear(HighresFrom({kVehicle, MAV_COMP_ID_CAMERA}, AutopilotUs()));
  Hear(HighresFrom({}, AutopilotUs(), 0x38));  // The accelerometer's is the message's before.
  EXPECT_TRUE(samples_.empty());
  Hear(HighresFrom({}, AutopilotUs(), 0));
  EXPECT_EQ(samples_.size(), 1u) << "it does not say what is new";
}

TEST_F(AutopilotInertialTest, TheAutopilotIsAskedOnceItIsHeard) {
  EXPECT_TRUE(Of(Due(), MAVLINK_MSG_ID_COMMAND_LONG).empty());
  session_->Hear(HeartbeatFrom(kVehicle, MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  const auto asked = Of(Due(), MAVLINK_MSG_ID_COMMAND_LONG);
  ASSERT_EQ(asked.size(), 1u);
  mavlink_command_long_t command;
  mavlink_msg_command_long_decode(&asked[0], &command);
  EXPECT_EQ(command.command, MAV_CMD_SET_MESSAGE_INTERVAL);
  EXPECT_EQ(command.param1, 105);
  EXPECT_EQ(command.param2, 5000);
  EXPECT_EQ(command.target_system, kVehicle);
  EXPECT_EQ(command.target_component, MAV_COMP_ID_AUTOPILOT1);
  size_t highres = 0, scaled = 0;
  for (const int64_t end = now_ + 60 * kSecond; now_ < end; now_ += 25 * kMs) {
    if (now_ % kSecond == 0)
      session_->Hear(HeartbeatFrom(kVehicle, MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
    for (const mavlink_message_t& again : Of(Due(), MAVLINK_MSG_ID_COMMAND_LONG)) {
      mavlink_msg_command_long_decode(&again, &command);
      (command.param1 == 105 ? highres : scaled) += 1;
    }
  }
  EXPECT_GT(highres, 3u);
  EXPECT_LT(highres, 10u);
  EXPECT_EQ(scaled, highres - 2);
  now_ += 30 * kSecond;
  EXPECT_TRUE(Of(Due(), MAVLINK_MSG_ID_COMMAND_LONG).empty()) << "it is gone";
}

TEST_F(AutopilotInertialTest, ThatTheyComeIsSaid) {
  Meet();
  std::vector<std::string> texts;
  for (const int64_t end = now_ + 3 * kSecond; now_ < end; now_ += 5 * kMs) {
    Hear(HighresFrom({}, AutopilotUs()));
    for (const mavlink_message_t& message : Of(Due(), MAVLINK_MSG_ID_STATUSTEXT)) {
      char text[51] = {};
      mavlink_msg_statustext_get_text(&message, text);
      texts.emplace_back(text);
    }
  }
  EXPECT_EQ(std::ranges::count(texts, "SLAM: inertial samples of the autopilot at 200 Hz"), 1);
}

TEST_F(AutopilotInertialTest, WhoDoesNotWantThemNeitherAsksNorHears) {
  session_.emplace(AutopilotOptions{}, kStart, Kept());
  Meet();
  Hear(HighresFrom({}, AutopilotUs()));
  EXPECT_TRUE(samples_.empty());
  EXPECT_TRUE(Of(Due(), MAVLINK_MSG_ID_COMMAND_LONG).empty());
}

TEST_F(AutopilotInertialTest, GarbageIsLeftAside) {
  Meet();
  Random random(9);
  for (int i = 0; i < 20'000; ++i, now_ += kMs) {
    std::string datagram = random.Index(2) == 0 ? HighresFrom({}, AutopilotUs())
                                                : ScaledFrom({}, static_cast<uint32_t>(i));
    const bool is_cut = random.Index(4) == 0;
    if (is_cut) datagram.resize(static_cast<size_t>(random.Index(100)), '\x7f');
    for (int k = random.Index(6) + 1; k > 0 && !datagram.empty(); --k)
      datagram[static_cast<size_t>(random.Index(static_cast<int>(datagram.size())))] ^=
          static_cast<char>(1 + random.Index(255));
    Hear(datagram);
  }
  // A checksum of 16 bits lets few through.
  EXPECT_LT(samples_.size(), 20u);
  const size_t before = samples_.size();
  now_ += kSecond;
  Hear(HighresFrom({}, AutopilotUs()));
  EXPECT_EQ(samples_.size(), before + 1);
}

}  // namespace
}  // namespace deepuav
