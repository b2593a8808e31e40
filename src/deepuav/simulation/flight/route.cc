#include "deepuav/simulation/flight/route.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/simulation/flight/course_options.h"

namespace deepuav {
namespace {

constexpr double kKnotSpacingS = 0.8;
constexpr int kLeastPieces = 4;
constexpr int kSamplesOfPiece = 20;
constexpr int kStretchings = 8;
constexpr double kShare = 0.85;  // of the limits, for what the smooth curve adds to the profile
constexpr double kLeastSpeed = 0.05;
constexpr int kSmoothings = 3;
constexpr double kSamePlaceM = 1e-6;

double Distance(const FlatOutput& a, const FlatOutput& b) { return (b - a).head<3>().norm(); }

double ShorterTurn(double from, double to) {
  return std::remainder(to - from, 2 * std::numbers::pi);
}

std::vector<double> ArcLengths(const std::vector<FlatOutput>& points) {
  std::vector<double> lengths{0};
  for (size_t i = 1; i < points.size(); ++i)
    lengths.push_back(lengths.back() + Distance(points[i - 1], points[i]));
  return lengths;
}

std::vector<FlatOutput> MovingAverage(const std::vector<FlatOutput>& points, int half_width) {
  const int last = static_cast<int>(points.size()) - 1;
  std::vector<FlatOutput> averages;
  averages.reserve(points.size());
  for (int i = 0; i <= last; ++i) {
    const int reach = std::min({half_width, i, last - i});  // symmetric, so that the ends stay
    FlatOutput sum = FlatOutput::Zero();
    for (int k = i - reach; k <= i + reach; ++k) sum += points[static_cast<size_t>(k)];
    averages.push_back(sum / (2 * reach + 1));
  }
  return averages;
}

// The speeds at the points that bends and turns allow, then what can be reached from rest and
// braked to rest.
std::vector<double> SpeedProfile(const std::vector<FlatOutput>& points,
                                 const std::vector<double>& lengths, const MotionLimits& limits) {
  const double acceleration = kShare * limits.acceleration_m_s2;
  const size_t count = points.size();
  std::vector<double> speeds(count, kShare * limits.speed_m_s);
  for (size_t i = 1; i + 1 < count; ++i) {
    const double before = lengths[i] - lengths[i - 1], after = lengths[i + 1] - lengths[i];
    const Eigen::Vector3d bend = ((points[i + 1] - points[i]) / after).head<3>() -
                                 ((points[i] - points[i - 1]) / before).head<3>();
    const double curvature = 2 * bend.norm() / (before + after);
    if (curvature > 0) speeds[i] = std::min(speeds[i], std::sqrt(acceleration / curvature));
    const double turn = std::abs(points[i + 1].w() - points[i - 1].w()) / (before + after);
    if (turn > 0) speeds[i] = std::min(speeds[i], kShare * limits.yaw_rate_rad_s / turn);
  }
  speeds.front() = speeds.back() = 0;
  const auto reachable = [&](double from, double distance) {
    return std::sqrt(from * from + 2 * acceleration * distance);
  };
  for (size_t i = 1; i < count; ++i)
    speeds[i] = std::min(speeds[i], reachable(speeds[i - 1], lengths[i] - lengths[i - 1]));
  for (size_t i = count - 1; i > 0; --i)
    speeds[i - 1] = std::min(speeds[i - 1], reachable(speeds[i], lengths[i] - lengths[i - 1]));
  return speeds;
}

std::vector<double> Times(const std::vector<double>& lengths, const std::vector<double>& speeds) {
  std::vector<double> times_s{0};
  for (size_t i = 1; i < lengths.size(); ++i) {
    const double mean = std::max((speeds[i - 1] + speeds[i]) / 2, kLeastSpeed);
    times_s.push_back(times_s.back() + (lengths[i] - lengths[i - 1]) / mean);
  }
  return times_s;
}

FlatOutput Interpolate(const std::vector<double>& times_s, const std::vector<FlatOutput>& points,
                       double t) {
  const auto after = std::upper_bound(times_s.begin() + 1, times_s.end() - 1, t);
  const auto i = static_cast<size_t>(after - times_s.begin());
  const double share = (t - times_s[i - 1]) / (times_s[i] - times_s[i - 1]);
  return points[i - 1] + share * (points[i] - points[i - 1]);
}

// How much slower each piece must be flown to keep the limits; at least 1.
std::vector<double> Slowdowns(const MinimumSnapCurve& curve, const std::vector<double>& times_s,
                              const MotionLimits& limits) {
  std::vector<double> slowdowns;
  for (size_t i = 1; i < times_s.size(); ++i) {
    double& slowdown = slowdowns.emplace_back(1);
    for (int k = 0; k <= kSamplesOfPiece; ++k) {
      const FlatState state =
          curve.At(times_s[i - 1] + (times_s[i] - times_s[i - 1]) * k / kSamplesOfPiece);
      slowdown =
          std::max({slowdown, state.velocity.head<3>().norm() / limits.speed_m_s,
                    std::sqrt(state.acceleration.head<3>().norm() / limits.acceleration_m_s2),
                    std::abs(state.velocity.w()) / limits.yaw_rate_rad_s});
    }
  }
  return slowdowns;
}

// Slows down where the limits are broken and, so that the changes of speed stay mild, around.
void StretchPieces(const std::vector<double>& slowdowns, std::vector<double>* times_s) {
  const std::vector<double> old_times_s = *times_s;
  for (size_t i = 0; i < slowdowns.size(); ++i) {
    const double before = slowdowns[i == 0 ? 0 : i - 1];
    const double after = slowdowns[std::min(i + 1, slowdowns.size() - 1)];
    const double stretch = (before + 2 * slowdowns[i] + after) / 4;
    (*times_s)[i + 1] = (*times_s)[i] + stretch * (old_times_s[i + 1] - old_times_s[i]);
  }
}

MinimumSnapCurve WithinLimits(std::vector<double> times_s, const std::vector<FlatOutput>& values,
                              const MotionLimits& limits) {
  for (int i = 0; i < kStretchings; ++i) {
    const std::vector<double> slowdowns =
        Slowdowns(MinimumSnapCurve(times_s, values), times_s, limits);
    if (*std::max_element(slowdowns.begin(), slowdowns.end()) == 1) break;
    StretchPieces(slowdowns, &times_s);
  }
  // What little is left is spread evenly, which ends it for certain.
  const std::vector<double> slowdowns =
      Slowdowns(MinimumSnapCurve(times_s, values), times_s, limits);
  const double most = *std::max_element(slowdowns.begin(), slowdowns.end());
  for (double& time_s : times_s) time_s *= most;
  return MinimumSnapCurve(std::move(times_s), values);
}

}  // namespace

std::vector<FlatOutput> Resample(const std::vector<FlatOutput>& points, double step_m) {
  std::vector<FlatOutput> resampled{points.front()};
  for (size_t i = 1; i < points.size(); ++i) {
    const FlatOutput from = resampled.back();
    FlatOutput to = points[i];
    to.w() = from.w() + ShorterTurn(from.w(), to.w());
    const double length = Distance(from, to);
    if (length < kSamePlaceM) {
      resampled.back() = to;
      continue;
    }
    const int steps = static_cast<int>(std::ceil(length / step_m));
    for (int k = 1; k <= steps; ++k) resampled.push_back(from + (to - from) * k / steps);
  }
  return resampled;
}

std::vector<FlatOutput> Smooth(const std::vector<FlatOutput>& points, double step_m,
                               double window_m) {
  const int half_width = static_cast<int>(std::lround(window_m / (2 * kSmoothings * step_m)));
  std::vector<FlatOutput> smooth = points;
  for (int i = 0; i < kSmoothings; ++i) smooth = MovingAverage(smooth, half_width);
  return smooth;
}

std::vector<MinimumSnapCurve> FlyAlong(const std::vector<FlatOutput>& points,
                                       const MotionLimits& limits) {
  if (points.size() < 2) return {};
  const std::vector<double> lengths = ArcLengths(points);
  const std::vector<double> times_s = Times(lengths, SpeedProfile(points, lengths, limits));
  if (!(times_s.back() <= kLongestFlightS)) {
    throw Error(
        "the course takes {:.0f} s to fly: expected at most {} (course.speed_m_s, course.laps, its "
        "size)",
        times_s.back(), kLongestFlightS);
  }
  const int pieces =
      std::max(kLeastPieces, static_cast<int>(std::ceil(times_s.back() / kKnotSpacingS)));
  std::vector<double> knot_times_s;
  std::vector<FlatOutput> knots;
  for (int i = 0; i <= pieces; ++i) {
    knot_times_s.push_back(times_s.back() * i / pieces);
    knots.push_back(Interpolate(times_s, points, knot_times_s.back()));
  }
  return {WithinLimits(std::move(knot_times_s), knots, limits)};
}

std::vector<MinimumSnapCurve> TurnOnTheSpot(const FlatOutput& from, double turn_rad,
                                            const MotionLimits& limits) {
  if (turn_rad == 0) return {};
  FlatOutput to = from;
  to.w() += turn_rad;
  return {WithinLimits({0, std::abs(turn_rad) / limits.yaw_rate_rad_s}, {from, to}, limits)};
}

std::vector<MinimumSnapCurve> FlyLegs(const std::vector<Leg>& legs, const MotionLimits& limits) {
  std::vector<MinimumSnapCurve> curves;
  const auto append = [&](std::vector<MinimumSnapCurve> more) {
    curves.insert(curves.end(), more.begin(), more.end());
  };
  double yaw = legs.front().points.front().w();
  for (const Leg& leg : legs) {
    std::vector<FlatOutput> points = leg.points;
    const double to_start = ShorterTurn(yaw, points.front().w());
    FlatOutput start = points.front();
    start.w() = yaw;
    append(TurnOnTheSpot(start, to_start, limits));
    const double unwrapped = yaw + to_start - points.front().w();
    for (FlatOutput& point : points) point.w() += unwrapped;
    append(FlyAlong(points, limits));
    const FlatOutput& end = points.back();
    if (leg.pause_s > 0) curves.push_back(MinimumSnapCurve({0, leg.pause_s}, {end, end}));
    append(TurnOnTheSpot(end, leg.turn_rad, limits));
    yaw = end.w() + leg.turn_rad;
  }
  return curves;
}

}  // namespace deepuav
