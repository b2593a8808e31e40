#include "deepuav/autopilot/autopilot_gnss.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace deepuav {
namespace {

constexpr int64_t kMostClock_us = (int64_t{1} << 61) / 1000;

double Seconds(int64_t ns) { return 1e-9 * static_cast<double>(ns); }

bool IsWithin(const std::optional<int64_t>& since_ns, int64_t now_ns, double seconds) {
  return since_ns && Seconds(now_ns - *since_ns) < seconds;
}

/// What receivers say before the first fix is at 0, 0.
bool IsSomewhere(const GeoPoint& place) {
  constexpr double kPole_deg = 90, kHalfTurn_deg = 180, kLowest_m = -1'000, kHighest_m = 100'000;
  return std::abs(place.latitude_deg) <= kPole_deg &&
         std::abs(place.longitude_deg) <= kHalfTurn_deg && place.altitude_m >= kLowest_m &&
         place.altitude_m <= kHighest_m && (place.latitude_deg != 0 || place.longitude_deg != 0);
}

/// One that the receiver has not measured anew.
bool IsTheSame(const FixMessage& a, const FixMessage& b) {
  return a.time_us != 0 ? a.time_us == b.time_us : b.time_us == 0 && a.place == b.place;
}

}  // namespace

/// What is of no time about now is of another clock, as a receiver's may be.
int64_t AutopilotGnss::TimeOf(const FixMessage& message, const ClockSync& clock,
                              int64_t now_ns) const {
  if (message.time_us <= 0 || message.time_us > kMostClock_us) return now_ns;
  const int64_t time_ns = 1000 * message.time_us - clock.TimeOf(0);
  const double age_s = Seconds(now_ns - time_ns);
  return age_s >= -options_.max_ahead_s && age_s <= options_.max_age_s ? time_ns : now_ns;
}

std::optional<GnssFix> AutopilotGnss::Take(const FixMessage& message, const ClockSync& clock,
                                           int64_t now_ns) {
  const auto leave = [](int64_t* count) {
    ++*count;
    return std::nullopt;
  };
  message_ns_ = now_ns;
  const std::optional<FixMessage> before = std::exchange(sent_, message);
  if (!message.has_place || !IsSomewhere(message.place)) return leave(&left_aside_.no_place);
  if (message.horizontal_sigma_m > options_.max_sigma_m) return leave(&left_aside_.uncertain);
  if (before && IsTheSame(*before, message)) return leave(&left_aside_.out_of_time);
  if (!clock.is_known()) return leave(&left_aside_.before_clock);
  const int64_t time_ns = TimeOf(message, clock, now_ns);
  if (last_ns_ && Seconds(time_ns - *last_ns_) < options_.least_interval_s)
    return leave(&left_aside_.out_of_time);
  last_ns_ = time_ns;
  taken_ns_ = now_ns;
  return GnssFix{
      {time_ns},
      message.place.latitude_deg,
      message.place.longitude_deg,
      message.place.altitude_m,
      {message.horizontal_sigma_m, message.horizontal_sigma_m, message.vertical_sigma_m}};
}

void AutopilotGnss::Restart() {
  fixes_.Restart();
  origin_.Restart();
  origin_ns_.reset();
}

AutopilotGnss::Ask AutopilotGnss::DueAsk(int64_t now_ns) {
  const double origin_gone_s = 3 * options_.origin_every_s;
  return {fixes_.IsDue(now_ns, IsWithin(message_ns_, now_ns, options_.stopped_s)),
          origin_.IsDue(now_ns, IsWithin(origin_ns_, now_ns, origin_gone_s))};
}

std::string AutopilotGnss::WhyNone() const {
  if (left_aside_.before_clock > 0) return "they come, but its clock is not known (TIMESYNC)";
  if (left_aside_.uncertain > 0)
    return fmt::format("they come, but none is known to {:.0f} m", options_.max_sigma_m);
  if (left_aside_.no_place > 0) return "its receiver has no fix";
  return "none came, though it was asked for GPS_RAW_INT";
}

std::optional<AutopilotNews> AutopilotGnss::DueNews(int64_t now_ns) {
  if (!taken_ns_) {
    const auto& asked_ns = fixes_.first_asked_ns();
    if (!asked_ns || IsWithin(asked_ns, now_ns, options_.none_came_s)) return std::nullopt;
    if (std::exchange(said_there_are_none_, true)) return std::nullopt;
    return AutopilotNews{"SLAM: no position fixes", WhyNone(), true};
  }
  const bool comes = IsWithin(taken_ns_, now_ns, options_.stopped_s);
  if (comes == std::exchange(says_they_come_, comes)) return std::nullopt;
  if (comes) return AutopilotNews{"SLAM: position fixes of the autopilot", "GPS_RAW_INT", false};
  const LeftAside& left = left_aside_;
  return AutopilotNews{
      "SLAM: position fixes of the autopilot stopped",
      fmt::format("left aside until now: {} without place, {} uncertain, {} before the clock was "
                  "known, {} not later than the one before",
                  left.no_place, left.uncertain, left.before_clock, left.out_of_time),
      true};
}

}  // namespace deepuav
