#include "deepuav/autopilot/autopilot_session.h"

#include <algorithm>
#include <cmath>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr double kHeartbeatEvery = 1, kTextAgainEvery = 30, kOriginEvery = 1;  // Seconds.
constexpr double kQuestionEvery = 1, kFirstQuestionEvery = 0.1;
constexpr int64_t kSettled = kSecond / 2;  // A state is told of once it has lasted so long.
constexpr int64_t kAway = 5 * kSecond;     // An autopilot that was silent for so long began anew.
constexpr int kMostAnswersPerSecond = 100, kOriginTries = 5;
constexpr double kSameOrigin_m = 1;   // Altitudes are rounded on the way, and by some cut off.
constexpr int64_t kStep = 1'000'000;  // Microseconds: then it is another clock.

const char* TextOf(OdometryEstimator::Silence why) {
  switch (why) {
    case OdometryEstimator::Silence::kNone:
      return "SLAM: sends odometry";
    case OdometryEstimator::Silence::kNoImage:
      return "SLAM: no odometry: no image located";
    case OdometryEstimator::Silence::kLost:
      return "SLAM: no odometry: the camera is lost";
    case OdometryEstimator::Silence::kNoScale:
      break;
  }
  return "SLAM: no odometry: the map has no scale";
}

double Apart(const GeoPoint& a, const GeoPoint& b) { return LocalFromGeo(a, b).norm(); }

bool IsNear(const GeoPoint& a, const GeoPoint& b) { return Apart(a, b) < kSameOrigin_m; }

}  // namespace

void AutopilotOptions::Check() const { CheckOptions("", *this); }

AutopilotSession::AutopilotSession(const AutopilotOptions& options, int64_t now_ns,
                                   AutopilotListener told)
    : options_(options),
      start_ns_(now_ns),
      listener_(std::move(told)),
      writer_(options.system_id),
      imu_(options.imu),
      gnss_(options.gnss),
      heartbeat_ns_(now_ns - 60 * kSecond),
      question_ns_(heartbeat_ns_),
      text_ns_(heartbeat_ns_),
      origin_ns_(heartbeat_ns_),
      answers_ns_(heartbeat_ns_),
      autopilot_system_(options.system_id) {
  options_.Check();
}

bool AutopilotSession::IsDue(double every_s, int64_t now_ns, int64_t* last_ns) {
  if (now_ns - *last_ns < std::llround(every_s * kSecond)) return false;
  *last_ns = now_ns;
  return true;
}

uint64_t AutopilotSession::GrowingTime(int64_t time_ns) {
  const int64_t time_us = std::max<int64_t>(clock_.TimeOf(time_ns) / 1000, 1);
  const bool is_other_clock = std::abs(time_us - last_time_us_) > kStep;
  last_time_us_ = is_other_clock ? time_us : std::max(time_us, last_time_us_ + 1);
  return static_cast<uint64_t>(last_time_us_);
}

void AutopilotSession::TellState(Silence why, int64_t now_ns, std::vector<std::string>* due) {
  if (pending_ != why) {
    pending_ = why;
    pending_ns_ = now_ns;
  }
  const bool is_new = told_ != why && now_ns - pending_ns_ >= kSettled;
  const bool again = told_ == why && why != Silence::kNone &&
                     now_ns - text_ns_ >= std::llround(kTextAgainEvery * kSecond);
  if (!is_new && !again) return;
  told_ = why;
  text_ns_ = now_ns;
  due->push_back(writer_.StatusText(TextOf(why), why != Silence::kNone));
  if (!is_new) return;
  if (why != Silence::kNoScale) return Log().info("autopilot: {}", TextOf(why));
  if (!std::exchange(warned_of_scale_, true)) {
    Log().warn(
        "autopilot: {}: positions need a map in metres, as one of an earlier run with IMU or "
        "position fixes (--map), or what its own sensors will tell of this one (--mavlink-imu, "
        "--mavlink-gnss)",
        TextOf(why));
  }
}

void AutopilotSession::TellOrigin(const std::optional<GeoPoint>& origin, int64_t now_ns,
                                  std::vector<std::string>* due) {
  if (origin != origin_) {
    origin_ = origin;
    const bool has_it = origin && heard_origin_ && IsNear(*origin, *heard_origin_);
    origin_tries_ = origin && !has_it ? kOriginTries : 0;
    warned_of_origin_ = false;
  }
  if (origin_tries_ == 0) return TellOfOtherOrigin(due);
  if (!IsDue(kOriginEvery, now_ns, &origin_ns_)) return;
  --origin_tries_;
  const auto time_us = static_cast<uint64_t>(std::max<int64_t>(clock_.TimeOf(now_ns) / 1000, 0));
  due->push_back(writer_.GlobalOrigin(*origin_, autopilot_system_, time_us));
}

void AutopilotSession::TellOfOtherOrigin(std::vector<std::string>* due) {
  if (!origin_ || !heard_origin_) return;
  if (IsNear(*origin_, *heard_origin_) || std::exchange(warned_of_origin_, true)) return;
  const double apart_m = Apart(*origin_, *heard_origin_);
  const std::string text = fmt::format("SLAM: your origin is {:.0f} m off the map's", apart_m);
  due->push_back(writer_.StatusText(text, true));
  Log().warn("autopilot: {}: positions are told from the map's", text);
}

std::vector<std::string> AutopilotSession::Due(const OdometryEstimator::Answer& answer,
                                               int64_t now_ns) {
  std::vector<std::string> due;
  if (IsDue(kHeartbeatEvery, now_ns, &heartbeat_ns_))
    due.push_back(writer_.Heartbeat(answer.odometry.has_value()));
  if (IsDue(clock_.is_known() ? kQuestionEvery : kFirstQuestionEvery, now_ns, &question_ns_))
    due.push_back(writer_.Timesync(0, clock_.Ask(now_ns)));
  TellState(answer.why, now_ns, &due);
  TellOrigin(answer.origin, now_ns, &due);
  TellOfInertial(now_ns, &due);
  TellOfFixes(now_ns, &due);
  const bool waits_for_clock =
      !clock_.is_known() && now_ns - start_ns_ < std::llround(options_.clock_wait_s * kSecond);
  if (!answer.odometry || waits_for_clock) return due;
  const uint64_t time_us = GrowingTime(answer.odometry->time_ns);
  due.push_back(options_.vision_position ? writer_.VisionPosition(*answer.odometry, time_us)
                                         : writer_.Odometry(*answer.odometry, time_us));
  return due;
}

void AutopilotSession::Heartbeat(int system_id, int64_t now_ns) {
  // Behind a router there may be several vehicles.
  if (IsThere(now_ns) && system_id != autopilot_system_) return;
  const bool is_new = !autopilot_ns_ || now_ns - *autopilot_ns_ > kAway;
  autopilot_ns_ = now_ns;
  autopilot_system_ = system_id;
  if (!is_new) return;
  // It has not heard what was said before.
  Log().info("autopilot: heard, system {}", system_id);
  told_.reset();
  imu_.Restart();
  gnss_.Restart();
  if (origin_) origin_tries_ = kOriginTries;
  heard_origin_.reset();
  warned_of_origin_ = false;
}

void AutopilotSession::TellOfInertial(int64_t now_ns, std::vector<std::string>* due) {
  if (!options_.imu.wanted) return;
  if (IsThere(now_ns)) {
    const AutopilotImu::Ask ask = imu_.DueAsk(now_ns);
    const auto request = [&](RequestedMessage message) {
      due->push_back(writer_.RequestMessage(message, autopilot_system_, options_.imu.rate_hz));
    };
    if (ask.highres) request(RequestedMessage::kHighresImu);
    if (ask.scaled) request(RequestedMessage::kScaledImu);
  }
  TellNews(imu_.DueNews(now_ns), due);
}

void AutopilotSession::TellOfFixes(int64_t now_ns, std::vector<std::string>* due) {
  if (!options_.gnss.wanted) return;
  if (IsThere(now_ns)) {
    const AutopilotGnss::Ask ask = gnss_.DueAsk(now_ns);
    const auto request = [&](RequestedMessage message, double rate_hz) {
      due->push_back(writer_.RequestMessage(message, autopilot_system_, rate_hz));
    };
    if (ask.fixes) request(RequestedMessage::kGnss, options_.gnss.rate_hz);
    if (ask.origin) request(RequestedMessage::kGlobalOrigin, 1 / options_.gnss.origin_every_s);
  }
  TellNews(gnss_.DueNews(now_ns), due);
}

void AutopilotSession::TellNews(const std::optional<AutopilotNews>& news,
                                std::vector<std::string>* due) {
  if (!news) return;
  due->push_back(writer_.StatusText(news->text, news->is_warning));
  Log().log(news->is_warning ? spdlog::level::warn : spdlog::level::info, "autopilot: {} ({})",
            news->text, news->why);
}

bool AutopilotSession::IsThere(int64_t now_ns) const {
  return autopilot_ns_ && now_ns - *autopilot_ns_ <= kAway;
}

/// Whose heartbeat was heard.
bool AutopilotSession::IsOfTheAutopilot(int system_id) const {
  return autopilot_ns_ && system_id == autopilot_system_;
}

void AutopilotSession::TakeInertial(const InertialMessage& message, int64_t now_ns) {
  if (!IsOfTheAutopilot(message.system_id)) return;
  const std::optional<ImuSample> sample = imu_.Take(message, clock_, now_ns);
  if (sample && listener_.inertial) listener_.inertial(*sample);
}

void AutopilotSession::TakeFix(const FixMessage& message, int64_t now_ns) {
  if (!IsOfTheAutopilot(message.system_id)) return;
  const std::optional<GnssFix> fix = gnss_.Take(message, clock_, now_ns);
  if (fix && listener_.fix) listener_.fix(*fix);
}

void AutopilotSession::TakeOrigin(const GeoPoint& origin, int64_t now_ns) {
  heard_origin_ = origin;
  origin_tries_ = 0;
  gnss_.HeardOrigin(now_ns);
  if (options_.gnss.wanted && autopilot_ns_ && listener_.origin) listener_.origin(origin);
}

std::vector<std::string> AutopilotSession::Hear(std::string_view datagram, int64_t now_ns) {
  std::vector<std::string> answers;
  const auto timesync = [&](int64_t clock_ns, int64_t mark_ns) {
    if (clock_ns != 0) return clock_.Answer(clock_ns, mark_ns, now_ns);
    if (IsDue(1, now_ns, &answers_ns_)) answers_ = 0;
    if (++answers_ > kMostAnswersPerSecond) return;
    answers.push_back(writer_.Timesync(clock_.TimeOf(now_ns), mark_ns));
  };
  MavlinkListener listener{[&](int system_id) { Heartbeat(system_id, now_ns); }, timesync,
                           [&](int system_id, const GeoPoint& origin) {
                             if (!autopilot_ns_ || system_id == autopilot_system_)
                               TakeOrigin(origin, now_ns);
                           }};
  if (options_.imu.wanted)
    listener.inertial = [&](const InertialMessage& message) { TakeInertial(message, now_ns); };
  if (options_.gnss.wanted)
    listener.fix = [&](const FixMessage& message) { TakeFix(message, now_ns); };
  ReadMavlink(datagram, listener);
  return answers;
}

}  // namespace deepuav
