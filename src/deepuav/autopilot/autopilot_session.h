#pragma once

#include <functional>
#include <string>
#include <vector>

#include "deepuav/autopilot/autopilot_gnss.h"
#include "deepuav/autopilot/autopilot_imu.h"
#include "deepuav/autopilot/clock_sync.h"
#include "deepuav/autopilot/mavlink_messages.h"
#include "deepuav/base/option_bounds.h"

namespace deepuav {

struct AutopilotOptions {
  double rate_hz = 40;           ///< Of the odometry.
  int system_id = 1;             ///< Of MAVLink, as the vehicle's.
  bool vision_position = false;  ///< VISION_POSITION_ESTIMATE in place of ODOMETRY.
  double clock_wait_s = 3;       ///< For the autopilot's clock before times are the machine's own.
  AutopilotImuOptions imu = {};
  AutopilotGnssOptions gnss = {};

  /// Throws Error for values that cannot be.
  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rate_hz", rate_hz, "Hz", "of the odometry", Between(1, 200));
    visit("system_id", system_id, "", "of MAVLink, as the vehicle's", Between(1, 255));
    visit("vision_position", vision_position, "", "VISION_POSITION_ESTIMATE in place of ODOMETRY");
    visit("clock_wait_s", clock_wait_s, "s", "for the autopilot's clock", Between(0, 60));
    visit.Part("imu", imu);
    visit.Part("gnss", gnss);
  }
};

/// Who is told what an autopilot's sensors say, on the machine's clock, where the options want it.
struct AutopilotListener {
  /// Of its inertial sensor, in its body's axes.
  std::function<void(const ImuSample& sample)> inertial = nullptr;
  std::function<void(const GnssFix& fix)> fix = nullptr;
  /// Of its local frame, again and again.
  std::function<void(const GeoPoint& origin)> origin = nullptr;
};

/// What is said to an autopilot when, without sockets. Thread-compatible; times: nanoseconds of the
/// machine's clock.
class AutopilotSession {
 public:
  AutopilotSession(const AutopilotOptions& options, int64_t now_ns, AutopilotListener told = {});

  /// The datagrams that are due, once an odometry.
  std::vector<std::string> Due(const OdometryEstimator::Answer& answer, int64_t now_ns);
  /// The answers to a datagram that came.
  std::vector<std::string> Hear(std::string_view datagram, int64_t now_ns);

  bool clock_is_known() const { return clock_.is_known(); }

 private:
  using Silence = OdometryEstimator::Silence;
  /// Whether it is so long since it was said last, which it is from now on.
  static bool IsDue(double every_s, int64_t now_ns, int64_t* last_ns);
  void TellState(Silence why, int64_t now_ns, std::vector<std::string>* due);
  void TellOrigin(const std::optional<GeoPoint>& origin, int64_t now_ns,
                  std::vector<std::string>* due);
  /// Once, where the autopilot did not take the map's origin.
  void TellOfOtherOrigin(std::vector<std::string>* due);
  uint64_t GrowingTime(int64_t time_ns);
  void Heartbeat(int system_id, int64_t now_ns);
  bool IsThere(int64_t now_ns) const;
  bool IsOfTheAutopilot(int system_id) const;
  void TakeInertial(const InertialMessage& message, int64_t now_ns);
  void TakeFix(const FixMessage& message, int64_t now_ns);
  void TakeOrigin(const GeoPoint& origin, int64_t now_ns);
  void TellOfInertial(int64_t now_ns, std::vector<std::string>* due);
  void TellOfFixes(int64_t now_ns, std::vector<std::string>* due);
  void TellNews(const std::optional<AutopilotNews>& news, std::vector<std::string>* due);

  const AutopilotOptions options_;
  const int64_t start_ns_;
  const AutopilotListener listener_;
  MavlinkWriter writer_;
  ClockSync clock_;
  AutopilotImu imu_;
  AutopilotGnss gnss_;
  int64_t heartbeat_ns_, question_ns_, text_ns_, origin_ns_, answers_ns_;
  int answers_ = 0;  ///< To questions since then.
  int64_t last_time_us_ = 0;
  std::optional<int64_t> autopilot_ns_;  ///< When it was heard last.
  int autopilot_system_;
  std::optional<Silence> told_, pending_;  ///< What was said of the state, what is to be said...
  int64_t pending_ns_ = 0;                 ///< ...since then.
  bool warned_of_scale_ = false;
  std::optional<GeoPoint> origin_;
  int origin_tries_ = 0;
  std::optional<GeoPoint> heard_origin_;  ///< That the autopilot has, whoever set it.
  bool warned_of_origin_ = false;
};

}  // namespace deepuav
