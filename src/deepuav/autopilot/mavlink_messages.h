#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "deepuav/autopilot/odometry_estimator.h"

namespace deepuav {

enum class RequestedMessage { kHighresImu, kScaledImu, kGnss, kGlobalOrigin };

/// Makes MAVLink 2 messages, as bytes of one datagram each. Thread-compatible. Times: microseconds.
class MavlinkWriter {
 public:
  explicit MavlinkWriter(int system_id) : system_id_(static_cast<uint8_t>(system_id)) {}

  std::string Heartbeat(bool is_active);
  /// Frames LOCAL_FRD and BODY_FRD.
  std::string Odometry(const deepuav::Odometry& odometry, uint64_t time_us);
  std::string VisionPosition(const deepuav::Odometry& odometry, uint64_t time_us);
  /// A question: `clock_ns` is 0; an answer: the own clock and the question's mark.
  std::string Timesync(int64_t clock_ns, int64_t mark_ns);
  /// At most 50 letters of it. `is_warning`, else a notice.
  std::string StatusText(std::string_view text, bool is_warning);
  std::string GlobalOrigin(const GeoPoint& origin, int target_system, uint64_t time_us);
  /// A wish for the autopilot's messages of this kind, so often.
  std::string RequestMessage(RequestedMessage message, int target_system, double rate_hz);

 private:
  template <typename Encode>
  std::string Pack(Encode encode);

  const uint8_t system_id_;
  uint8_t sequence_ = 0;
};

/// What an autopilot's inertial sensor says, in its body's axes: x forward, y right, z down.
struct InertialMessage {
  int system_id = 0;
  bool is_highres = false;  ///< HIGHRES_IMU, else the coarser SCALED_IMU.
  int sensor = 0;
  bool is_measured = true;  ///< Since the message before.
  int64_t time_us = 0;      ///< On the autopilot's clock; 0 where it is none.
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d specific_force = Eigen::Vector3d::Zero();    ///< m/s^2
};

/// What an autopilot's GNSS receiver says (GPS_RAW_INT).
struct FixMessage {
  int system_id = 0;
  bool has_place = false;  ///< In three dimensions.
  int64_t time_us = 0;     ///< On the autopilot's clock, or of the receiver's.
  GeoPoint place;          ///< The altitude above the sea.
  double horizontal_sigma_m = 0, vertical_sigma_m = 0;  ///< 0: not stated.
};

/// What an autopilot says that concerns us.
struct MavlinkListener {
  std::function<void(int system_id)> heartbeat;  ///< Of an autopilot.
  std::function<void(int64_t clock_ns, int64_t mark_ns)> timesync;
  std::function<void(int system_id, const GeoPoint& origin)> global_origin;
  std::function<void(const InertialMessage& message)> inertial = {};  ///< May be none.
  std::function<void(const FixMessage& message)> fix = {};            ///< The same.
};

/// Reads one datagram; whatever is no whole message with a right checksum is left aside.
void ReadMavlink(std::string_view datagram, const MavlinkListener& listener);

}  // namespace deepuav
