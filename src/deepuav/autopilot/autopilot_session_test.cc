#include "deepuav/autopilot/autopilot_session.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/autopilot/testing/mavlink_bytes.h"
#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using Silence = OdometryEstimator::Silence;

constexpr int64_t kMs = 1'000'000, kSecond = 1000 * kMs, kStart = 100 * kSecond;
constexpr uint8_t kVehicle = 7;

std::string TimesyncFrom(uint8_t component, int64_t clock_ns, int64_t mark_ns) {
  return deepuav::TimesyncFrom(kVehicle, component, clock_ns, mark_ns);
}

std::string HeartbeatFrom(uint8_t component, uint8_t autopilot) {
  return deepuav::HeartbeatFrom(kVehicle, component, autopilot);
}

OdometryEstimator::Answer AnswerAt(int64_t time_ns) {
  OdometryEstimator::Answer answer;
  answer.why = Silence::kNone;
  answer.odometry.emplace();
  answer.odometry->time_ns = time_ns;
  answer.odometry->local_from_body = SE3(RotationExp({0.1, 0.2, 0.3}), {1, 2, -3});
  answer.odometry->velocity_body = {4, 5, 6};
  answer.odometry->turn_rate_body = {0.7, 0.8, 0.9};
  answer.odometry->reset_counter = 9;
  answer.odometry->quality = 55;
  for (int i = 0; i < 36; ++i) {
    answer.odometry->pose_covariance(i / 6, i % 6) = i;
    answer.odometry->velocity_covariance(i / 6, i % 6) = 100 + i;
  }
  return answer;
}

OdometryEstimator::Answer SilentAnswer(Silence why) {
  OdometryEstimator::Answer answer;
  answer.why = why;
  return answer;
}

class AutopilotSessionTest : public testing::Test {
 protected:
  /// What is said for so long, at 40 Hz.
  std::vector<mavlink_message_t> Run(double seconds, std::optional<Silence> silence = {}) {
    std::vector<mavlink_message_t> all;
    for (const int64_t end = now_ + std::llround(seconds * kSecond); now_ < end; now_ += 25 * kMs) {
      auto answer = silence ? SilentAnswer(*silence) : AnswerAt(now_);
      answer.origin = origin_;
      for (const auto& message : Decoded(session_->Due(answer, now_))) all.push_back(message);
    }
    return all;
  }
  static std::string Text(const mavlink_message_t& message) {
    char text[51] = {};
    mavlink_msg_statustext_get_text(&message, text);
    return text;
  }

  int64_t now_ = kStart;
  std::optional<AutopilotSession> session_{std::in_place, AutopilotOptions{}, kStart};
  std::optional<GeoPoint> origin_;
};

TEST_F(AutopilotSessionTest, OdometrySaysWhatItIsGiven) {
  Run(3.1);
  const auto messages = Of(Run(1), MAVLINK_MSG_ID_ODOMETRY);
  ASSERT_EQ(messages.size(), 40);
  EXPECT_EQ(messages[0].sysid, 1);
  EXPECT_EQ(messages[0].compid, MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY);
  mavlink_odometry_t odometry;
  mavlink_msg_odometry_decode(&messages[0], &odometry);
  EXPECT_EQ(odometry.time_usec, static_cast<uint64_t>(now_ - kSecond) / 1000)
      << "no other clock is known";
  EXPECT_EQ(odometry.frame_id, MAV_FRAME_LOCAL_FRD);
  EXPECT_EQ(odometry.child_frame_id, MAV_FRAME_BODY_FRD);
  EXPECT_EQ(odometry.estimator_type, MAV_ESTIMATOR_TYPE_VISION);
  EXPECT_EQ(odometry.x, 1);
  EXPECT_EQ(odometry.y, 2);
  EXPECT_EQ(odometry.z, -3);
  const Eigen::Quaterniond q = RotationExp({0.1, 0.2, 0.3});
  EXPECT_NEAR(odometry.q[0], q.w(), 1e-6);
  EXPECT_NEAR(odometry.q[1], q.x(), 1e-6);
  EXPECT_NEAR(odometry.q[2], q.y(), 1e-6);
  EXPECT_NEAR(odometry.q[3], q.z(), 1e-6);
  EXPECT_EQ(odometry.vx, 4);
  EXPECT_EQ(odometry.vz, 6);
  EXPECT_FLOAT_EQ(odometry.rollspeed, 0.7F);
  EXPECT_FLOAT_EQ(odometry.yawspeed, 0.9F);
  EXPECT_EQ(odometry.pose_covariance[0], 0);
  EXPECT_EQ(odometry.pose_covariance[5], 5);
  EXPECT_EQ(odometry.pose_covariance[6], 7);  // The second row begins at the diagonal.
  EXPECT_EQ(odometry.pose_covariance[20], 35);
  EXPECT_EQ(odometry.velocity_covariance[20], 135);
  EXPECT_EQ(odometry.reset_counter, 9);
  EXPECT_EQ(odometry.quality, 55);
}

TEST_F(AutopilotSessionTest, VisionPositionTakesItsPlaceOnRequest) {
  AutopilotOptions options;
  options.vision_position = true;
  options.system_id = kVehicle;
  session_.emplace(options, kStart);
  const auto all = Run(4);
  EXPECT_TRUE(Of(all, MAVLINK_MSG_ID_ODOMETRY).empty());
  const auto messages = Of(all, MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE);
  ASSERT_GT(messages.size(), 30);
  EXPECT_EQ(messages[0].sysid, kVehicle);
  mavlink_vision_position_estimate_t estimate;
  mavlink_msg_vision_position_estimate_decode(&messages[0], &estimate);
  const Eigen::Vector3d angles = EulerAngles(RotationExp({0.1, 0.2, 0.3}));
  EXPECT_EQ(estimate.z, -3);
  EXPECT_NEAR(estimate.roll, angles.x(), 1e-6);
  EXPECT_NEAR(estimate.pitch, angles.y(), 1e-6);
  EXPECT_NEAR(estimate.yaw, angles.z(), 1e-6);
  EXPECT_EQ(estimate.covariance[6], 7);
  EXPECT_EQ(estimate.reset_counter, 9);
}

TEST_F(AutopilotSessionTest, RefusesWithoutScaleAndSaysWhy) {
  const auto all = Run(29, Silence::kNoScale);
  EXPECT_TRUE(Of(all, MAVLINK_MSG_ID_ODOMETRY).empty());
  const auto texts = Of(all, MAVLINK_MSG_ID_STATUSTEXT);
  ASSERT_EQ(texts.size(), 1);
  EXPECT_NE(Text(texts[0]).find("no scale"), std::string::npos);
  EXPECT_EQ(mavlink_msg_statustext_get_severity(&texts[0]), MAV_SEVERITY_WARNING);
  const auto heartbeats = Of(all, MAVLINK_MSG_ID_HEARTBEAT);
  EXPECT_EQ(heartbeats.size(), 29);
  EXPECT_EQ(mavlink_msg_heartbeat_get_type(&heartbeats[0]), MAV_TYPE_ONBOARD_CONTROLLER);
  EXPECT_EQ(mavlink_msg_heartbeat_get_autopilot(&heartbeats[0]), MAV_AUTOPILOT_INVALID);
  EXPECT_EQ(mavlink_msg_heartbeat_get_system_status(&heartbeats[0]), MAV_STATE_STANDBY);
  const auto later = Run(1.5);
  EXPECT_EQ(Of(later, MAVLINK_MSG_ID_ODOMETRY).size(), 60);
  EXPECT_EQ(Of(later, MAVLINK_MSG_ID_STATUSTEXT).size(), 1);
  const auto active = Of(later, MAVLINK_MSG_ID_HEARTBEAT);
  EXPECT_EQ(mavlink_msg_heartbeat_get_system_status(&active[0]), MAV_STATE_ACTIVE);
}

TEST_F(AutopilotSessionTest, TimesAreTheAutopilotsOnceKnown) {
  constexpr int64_t kOffset = -90 * kSecond;
  const auto questions = Of(Run(0.05), MAVLINK_MSG_ID_TIMESYNC);
  ASSERT_EQ(questions.size(), 1);
  EXPECT_EQ(mavlink_msg_timesync_get_tc1(&questions[0]), 0);
  const int64_t mark = mavlink_msg_timesync_get_ts1(&questions[0]);
  // Of others than the autopilot, or to no question: left aside.
  EXPECT_TRUE(session_->Hear(TimesyncFrom(MAV_COMP_ID_CAMERA, 77, mark), mark + kMs).empty());
  EXPECT_TRUE(
      session_->Hear(TimesyncFrom(MAV_COMP_ID_AUTOPILOT1, 77, mark + 1), mark + kMs).empty());
  EXPECT_FALSE(session_->clock_is_known());
  session_->Hear(TimesyncFrom(MAV_COMP_ID_AUTOPILOT1, mark + kMs + kOffset, mark), mark + 2 * kMs);
  ASSERT_TRUE(session_->clock_is_known());
  const auto messages = Of(Run(1), MAVLINK_MSG_ID_ODOMETRY);
  ASSERT_EQ(messages.size(), 40) << "nothing to wait for any more";
  EXPECT_EQ(mavlink_msg_odometry_get_time_usec(&messages[0]),
            static_cast<uint64_t>(now_ - kSecond + kOffset) / 1000);
  // And so is the clock that it is answered with.
  const auto answers = Decoded(session_->Hear(TimesyncFrom(MAV_COMP_ID_AUTOPILOT1, 0, 4321), now_));
  ASSERT_EQ(answers.size(), 1);
  EXPECT_EQ(mavlink_msg_timesync_get_ts1(&answers[0]), 4321);
  EXPECT_EQ(mavlink_msg_timesync_get_tc1(&answers[0]), now_ + kOffset);
}

TEST_F(AutopilotSessionTest, TimesGrow) {
  uint64_t last = 0;
  for (int i = 0; i < 200; ++i, now_ += 25 * kMs) {
    const auto messages = Decoded(session_->Due(AnswerAt(now_ - 30 * kMs * (i % 3)), now_));
    for (const auto& message : Of(messages, MAVLINK_MSG_ID_ODOMETRY)) {
      const uint64_t time = mavlink_msg_odometry_get_time_usec(&message);
      EXPECT_GT(time, last);
      last = time;
    }
  }
  EXPECT_GT(last, 0);
}

TEST_F(AutopilotSessionTest, TheOriginIsToldUntilItIsHeard) {
  origin_ = GeoPoint{47.123456789, -8.5, 432.1};
  const auto told = Of(Run(3), MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN);
  ASSERT_EQ(told.size(), 3);
  mavlink_set_gps_global_origin_t origin;
  mavlink_msg_set_gps_global_origin_decode(&told[0], &origin);
  EXPECT_EQ(origin.latitude, 471234568);
  EXPECT_EQ(origin.longitude, -85000000);
  EXPECT_EQ(origin.altitude, 432100);
  EXPECT_TRUE(session_->Hear(OriginFrom(kVehicle, 471234568, -85000000, 432100), now_).empty());
  EXPECT_TRUE(Of(Run(5), MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN).empty());
  // An autopilot that began anew does not know it.
  session_->Hear(HeartbeatFrom(MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  const auto again = Of(Run(10), MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN);
  ASSERT_EQ(again.size(), 5);
  EXPECT_EQ(mavlink_msg_set_gps_global_origin_get_target_system(&again[0]), kVehicle);
}

/// Whether an origin 111 m off is told in the next seconds.
bool IsToldOf(const std::vector<mavlink_message_t>& messages,
              std::string (*text)(const mavlink_message_t&)) {
  const auto texts = Of(messages, MAVLINK_MSG_ID_STATUSTEXT);
  return std::count_if(texts.begin(), texts.end(), [&](const mavlink_message_t& message) {
           return text(message) == "SLAM: your origin is 111 m off the map's";
         }) == 1;
}

TEST_F(AutopilotSessionTest, AnOriginOfTheAutopilotsOwnIsToldOnce) {
  const std::string other = OriginFrom(kVehicle, 471244568, -85000000, 432100);
  session_->Hear(HeartbeatFrom(MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  session_->Hear(other, now_);
  EXPECT_FALSE(IsToldOf(Run(1), Text)) << "no map is there yet";
  origin_ = GeoPoint{47.123456789, -8.5, 432.1};
  EXPECT_FALSE(IsToldOf(Run(1), Text)) << "it may take the map's";
  EXPECT_TRUE(IsToldOf(Run(10), Text)) << "it kept its own";
  session_->Hear(other, now_);
  const auto more = Run(5);
  EXPECT_FALSE(IsToldOf(more, Text));
  EXPECT_TRUE(Of(more, MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN).empty());
  // Another autopilot has heard nothing of it.
  now_ += 60 * kSecond;
  session_->Hear(HeartbeatFrom(MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  session_->Hear(other, now_);
  EXPECT_TRUE(IsToldOf(Run(1), Text));
}

TEST_F(AutopilotSessionTest, AnAutopilotThatComesHearsTheState) {
  Run(2, Silence::kNoScale);
  session_->Hear(HeartbeatFrom(MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_INVALID), now_);
  EXPECT_TRUE(Of(Run(1, Silence::kNoScale), MAVLINK_MSG_ID_STATUSTEXT).empty()) << "a station";
  session_->Hear(HeartbeatFrom(MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
  EXPECT_EQ(Of(Run(1, Silence::kNoScale), MAVLINK_MSG_ID_STATUSTEXT).size(), 1);
}

TEST_F(AutopilotSessionTest, GarbageIsLeftAside) {
  Random random(5);
  const std::string good = TimesyncFrom(MAV_COMP_ID_AUTOPILOT1, 0, 1);
  int answers = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string datagram = good;
    datagram.resize(static_cast<size_t>(random.Index(600)), static_cast<char>(random.Index(256)));
    for (int k = random.Index(8); k >= 0 && !datagram.empty(); --k)
      datagram[static_cast<size_t>(random.Index(static_cast<int>(datagram.size())))] =
          static_cast<char>(random.Index(256));
    answers += static_cast<int>(session_->Hear(datagram, now_).size());
  }
  EXPECT_LT(answers, 101);
  EXPECT_FALSE(session_->clock_is_known());
  // Half a message at the end of one datagram is no part of the next.
  session_->Hear(good.substr(0, 10), now_ + 5 * kSecond);
  EXPECT_EQ(session_->Hear(good, now_ + 5 * kSecond).size(), 1);
}

TEST_F(AutopilotSessionTest, AFloodOfQuestionsIsNotAnswered) {
  int answers = 0;
  for (int i = 0; i < 5000; ++i)
    answers += static_cast<int>(
        session_->Hear(TimesyncFrom(MAV_COMP_ID_AUTOPILOT1, 0, i + 1), now_).size());
  EXPECT_EQ(answers, 100);
}

TEST(AutopilotOptions, AreChecked) {
  for (const AutopilotOptions& options :
       {AutopilotOptions{0}, AutopilotOptions{1000}, AutopilotOptions{40, 0},
        AutopilotOptions{40, 256}, AutopilotOptions{40, 1, false, -1}})
    EXPECT_THROW(options.Check(), Error);
}

}  // namespace
}  // namespace deepuav
