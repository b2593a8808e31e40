#include "deepuav/autopilot/autopilot_imu.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace deepuav {
namespace {

constexpr int64_t kMostClock_us = (int64_t{1} << 61) / 1000;

double Seconds(int64_t ns) { return 1e-9 * static_cast<double>(ns); }
int64_t Nanoseconds(double s) { return std::llround(1e9 * s); }

}  // namespace

bool AutopilotImu::IsPlausible(const InertialMessage& message) const {
  const auto within = [](const Eigen::Vector3d& vector, double most) {
    return vector.allFinite() && vector.cwiseAbs().maxCoeff() <= most;
  };
  return message.is_measured && within(message.specific_force, options_.max_specific_force) &&
         within(message.angular_velocity, options_.max_angular_velocity);
}

bool AutopilotImu::IsOfTheSensor(const InertialMessage& message, int64_t now_ns) {
  if (message.is_highres) {
    if (sensor_.value_or(message.sensor) != message.sensor) return false;
    sensor_ = message.sensor;
    highres_ns_ = now_ns;
    return true;
  }
  return !IsFine(now_ns);
}

bool AutopilotImu::IsFine(int64_t now_ns) const {
  return highres_ns_ && now_ns - *highres_ns_ <= Nanoseconds(options_.highres_gone_s);
}

std::optional<ImuSample> AutopilotImu::Take(const InertialMessage& message, const ClockSync& clock,
                                            int64_t now_ns) {
  const auto leave = [](int64_t* count) {
    ++*count;
    return std::nullopt;
  };
  if (!IsPlausible(message)) return leave(&left_aside_.implausible);
  if (!IsOfTheSensor(message, now_ns)) return leave(&left_aside_.other_sensor);
  if (counted_since_ns_) ++counted_;
  if (!counted_since_ns_) counted_since_ns_ = now_ns;
  if (!clock.is_known()) return leave(&left_aside_.before_clock);
  if (message.time_us <= 0 || message.time_us > kMostClock_us)
    return leave(&left_aside_.out_of_time);
  const int64_t time_ns = 1000 * message.time_us - offset_.Towards(clock.TimeOf(0), now_ns);
  const int64_t age_ns = now_ns - time_ns;
  const bool is_about_now =
      age_ns >= -Nanoseconds(options_.max_ahead_s) && Seconds(age_ns) <= options_.max_age_s;
  const bool follows = !last_ns_ || time_ns - *last_ns_ >= Nanoseconds(options_.least_interval_s);
  if (!is_about_now || !follows) return leave(&left_aside_.out_of_time);
  last_ns_ = time_ns;
  taken_ns_ = now_ns;
  return ImuSample{{time_ns}, message.angular_velocity, message.specific_force};
}

void AutopilotImu::Restart() {
  sensor_.reset();
  highres_ns_.reset();
  question_.Restart();
  asks_ = 0;
}

void AutopilotImu::MeasureRate(int64_t now_ns) {
  if (!counted_since_ns_) return;
  const int64_t counted_for = now_ns - *counted_since_ns_;
  if (counted_for < Nanoseconds(options_.rate_over_s)) return;
  rate_hz_ = counted_ / Seconds(counted_for);
  counted_since_ns_ = now_ns;
  if (std::exchange(counted_, 0) == 0) counted_since_ns_.reset();
}

AutopilotImu::Ask AutopilotImu::DueAsk(int64_t now_ns) {
  MeasureRate(now_ns);
  if (!question_.IsDue(now_ns, rate_hz_ >= options_.enough_of_rate * options_.rate_hz)) return {};
  const bool scaled = ++asks_ > options_.asks_for_highres_alone && !highres_ns_;
  return {true, scaled};
}

std::string AutopilotImu::WhyNone() const {
  if (left_aside_.before_clock > 0) return "they come, but its clock is not known (TIMESYNC)";
  if (left_aside_.out_of_time > 0) return "they come, but their times are of another clock";
  if (left_aside_.implausible > 0) return "they come, but are none that a sensor can measure";
  return "none came, though it was asked for HIGHRES_IMU and SCALED_IMU";
}

std::optional<AutopilotNews> AutopilotImu::DueNews(int64_t now_ns) {
  if (!taken_ns_) {
    const auto& asked_ns = question_.first_asked_ns();
    if (!asked_ns || now_ns - *asked_ns < Nanoseconds(options_.none_came_s)) return std::nullopt;
    if (std::exchange(said_there_are_none_, true)) return std::nullopt;
    return AutopilotNews{"SLAM: no inertial samples", WhyNone(), true};
  }
  const bool comes = now_ns - *taken_ns_ < Nanoseconds(options_.stopped_s);
  if (comes == says_they_come_ || (comes && rate_hz_ == 0)) return std::nullopt;
  says_they_come_ = comes;
  if (comes) {
    return AutopilotNews{
        fmt::format("SLAM: inertial samples of the autopilot at {:.0f} Hz", rate_hz_),
        IsFine(now_ns) ? "HIGHRES_IMU" : "SCALED_IMU", false};
  }
  const LeftAside& left = left_aside_;
  return AutopilotNews{
      "SLAM: inertial samples of the autopilot stopped",
      fmt::format("left aside until now: {} implausible, {} of other sensors, {} before the "
                  "clock was known, {} out of time",
                  left.implausible, left.other_sensor, left.before_clock, left.out_of_time),
      true};
}

}  // namespace deepuav
