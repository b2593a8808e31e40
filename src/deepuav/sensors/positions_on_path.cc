#include "deepuav/sensors/positions_on_path.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "deepuav/base/intervals.h"
#include "deepuav/base/option_check.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

/// The place in a series about a time.
template <typename Timed>
struct Bracket {
  const Timed *before = nullptr, *after = nullptr;  ///< The same one where it has this very time.
  double ratio = 0;                                 ///< Of the way from before to after.
};

/// The series without gaps of more than this, asked at growing times.
template <typename Timed>
class Bracketing {
 public:
  Bracketing(const std::vector<Timed>& series, double max_gap_s)
      : series_(series),
        max_gap_s_(std::max(max_gap_s, kLongestInMedianIntervals * MedianInterval_s(series))) {}

  std::optional<Bracket<Timed>> At(Timestamp time) {
    while (next_ < series_.size() && series_[next_].time < time) ++next_;
    if (next_ == series_.size()) return std::nullopt;
    const Timed& after = series_[next_];
    if (after.time == time) return Bracket<Timed>{&after, &after, 0};
    if (next_ == 0) return std::nullopt;
    const Timed& before = series_[next_ - 1];
    const double gap_s = SecondsBetween(before.time, after.time);
    if (gap_s > max_gap_s_) return std::nullopt;
    return Bracket<Timed>{&before, &after, SecondsBetween(before.time, time) / gap_s};
  }

  /// Of the neighbours of what At() found last; zero where there is none.
  Eigen::Vector3d VelocityOfPath() const {
    const size_t first = next_ == 0 ? 0 : next_ - 1;
    const size_t last = std::min(first + (next_ == 0 ? 1 : 2), series_.size() - 1);
    const double seconds = SecondsBetween(series_[first].time, series_[last].time);
    if (!(seconds > 0)) return Eigen::Vector3d::Zero();
    return (series_[last].world_from_cam.translation() -
            series_[first].world_from_cam.translation()) /
           seconds;
  }

 private:
  const std::vector<Timed>& series_;
  const double max_gap_s_;
  size_t next_ = 0;
};

std::vector<LocalFix> Shifted(std::vector<LocalFix> fixes, double seconds) {
  for (LocalFix& fix : fixes) fix.time.nanoseconds += std::llround(seconds * 1e9);
  return fixes;
}

Eigen::Vector3d PositionIn(const Bracket<LocalFix>& between) {
  return between.before->position_m +
         between.ratio * (between.after->position_m - between.before->position_m);
}

PositionOnPath Pair(const TimedPose& camera, const Eigen::Vector3d& velocity, const LocalFix& fix) {
  return {camera, velocity, fix.position_m, fix.sigma_m, fix.sigma_is_stated};
}

}  // namespace

void GnssNoise::Check() const { CheckOptions("sensors.gnss", *this); }

std::vector<LocalFix> LocalFixes(const std::vector<GnssFix>& fixes, const GeoPoint& origin,
                                 const GnssNoise& noise) {
  const bool has_altitude = HaveAltitudes(fixes);
  std::vector<LocalFix> local;
  for (const GnssFix& fix : fixes) {
    const GeoPoint point{fix.latitude_deg, fix.longitude_deg,
                         has_altitude ? *fix.altitude_m : origin.altitude_m};
    LocalFix& placed = local.emplace_back();
    placed.time = fix.time;
    placed.position_m = LocalFromGeo(origin, point);
    placed.sigma_is_stated = fix.sigma_m.x() > 0 && fix.sigma_m.y() > 0;
    placed.sigma_m = {noise.horizontal_sigma_m, noise.horizontal_sigma_m, noise.vertical_sigma_m};
    for (int axis = 0; axis < 3; ++axis) {
      if (fix.sigma_m[axis] > 0) placed.sigma_m[axis] = fix.sigma_m[axis];
    }
    if (!has_altitude) placed.sigma_m.z() = noise.level_flight_sigma_m;
  }
  return local;
}

std::vector<PositionOnPath> PlaceOnPath(const Trajectory& path, const std::vector<LocalFix>& fixes,
                                        double clock_offset_s, double max_gap_s) {
  const std::vector<LocalFix> shifted = Shifted(fixes, clock_offset_s);
  std::vector<PositionOnPath> placed;
  if (path.empty() || fixes.empty()) return placed;
  Bracketing along_path(path, max_gap_s);
  if (MedianInterval_s(path) <= MedianInterval_s(fixes)) {
    for (const LocalFix& fix : shifted) {
      const auto found = along_path.At(fix.time);
      if (!found) continue;
      const TimedPose camera = found->before == found->after
                                   ? *found->before
                                   : InterpolatePose(*found->before, *found->after, fix.time);
      placed.push_back(Pair(camera, along_path.VelocityOfPath(), fix));
    }
    return placed;
  }
  Bracketing along_fixes(shifted, max_gap_s);
  for (const TimedPose& camera : path) {
    const auto found = along_fixes.At(camera.time);
    if (!found) continue;
    LocalFix fix = *found->before;
    fix.position_m = PositionIn(*found);
    fix.sigma_m = fix.sigma_m.cwiseMax(found->after->sigma_m);
    along_path.At(camera.time);
    placed.push_back(Pair(camera, along_path.VelocityOfPath(), fix));
  }
  return placed;
}

std::vector<std::optional<Eigen::Vector3d>> PositionsAt(const std::vector<Timestamp>& times,
                                                        const std::vector<LocalFix>& fixes,
                                                        double clock_offset_s, double max_gap_s) {
  std::vector<std::optional<Eigen::Vector3d>> positions;
  const std::vector<LocalFix> shifted = Shifted(fixes, clock_offset_s);
  Bracketing along_fixes(shifted, max_gap_s);
  for (const Timestamp time : times) {
    const auto found = along_fixes.At(time);
    positions.push_back(found ? std::optional(PositionIn(*found)) : std::nullopt);
  }
  return positions;
}

}  // namespace deepuav
