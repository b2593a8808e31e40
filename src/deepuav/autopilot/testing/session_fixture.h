#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "deepuav/autopilot/autopilot_session.h"
#include "deepuav/autopilot/testing/mavlink_bytes.h"

namespace deepuav {

inline constexpr int64_t kMs = 1'000'000, kSecond = 1000 * kMs, kStart = 100 * kSecond;
inline constexpr uint8_t kVehicle = 7, kOther = 8;

/// A session with an autopilot whose clock is the machine's less a minute.
class SessionFixture : public testing::Test {
 protected:
  /// The autopilot's heartbeat and its clock.
  void Meet() {
    session_->Hear(HeartbeatFrom(kVehicle, MAV_COMP_ID_AUTOPILOT1, MAV_AUTOPILOT_PX4), now_);
    for (const mavlink_message_t& question : Of(Due(), MAVLINK_MSG_ID_TIMESYNC)) {
      session_->Hear(TimesyncFrom(kVehicle, MAV_COMP_ID_AUTOPILOT1, now_ - 60 * kSecond,
                                  mavlink_msg_timesync_get_ts1(&question)),
                     now_);
    }
  }
  int64_t AutopilotUs() const { return (now_ - 60 * kSecond) / 1000; }
  std::vector<mavlink_message_t> Due() {
    return Decoded(session_->Due(OdometryEstimator::Answer{}, now_));
  }
  void Hear(const std::string& datagram) { session_->Hear(datagram, now_); }

  int64_t now_ = kStart;
  std::optional<AutopilotSession> session_;
};

}  // namespace deepuav
