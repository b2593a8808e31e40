#pragma once

#include <vector>

#include "deepuav/simulation/flight/minimum_snap_curve.h"

namespace deepuav {

/// A polyline of flat outputs that is flown from rest to rest, and what follows at its end.
struct Leg {
  std::vector<FlatOutput> points;
  double pause_s = 0;   ///< Hover after it.
  double turn_rad = 0;  ///< Turned to the left on the spot, after the pause.
};

struct MotionLimits {
  double speed_m_s = 6;
  double acceleration_m_s2 = 3;
  double yaw_rate_rad_s = 1;
};

/// The same polyline with points every `step_m` or a little less; the turns of yaw are the shorter
/// ways. Points that lie on one another are left out, so that nothing is left of a polyline without
/// length but its end.
std::vector<FlatOutput> Resample(const std::vector<FlatOutput>& points, double step_m);

/// Moving averages over `window_m` in all (three in turn, so that even curvature is continuous) of
/// points `step_m` apart; the ends stay.
std::vector<FlatOutput> Smooth(const std::vector<FlatOutput>& points, double step_m,
                               double window_m);

/// One curve from rest to rest along points a metre or so apart, as fast as the limits allow: in
/// bends as the lateral acceleration, at the ends as the longitudinal one. Nothing where the points
/// do not lead anywhere. Throws Error where it would take longer than kLongestFlightS.
std::vector<MinimumSnapCurve> FlyAlong(const std::vector<FlatOutput>& points,
                                       const MotionLimits& limits);

/// The curve that turns on the spot; none where there is nothing to turn.
std::vector<MinimumSnapCurve> TurnOnTheSpot(const FlatOutput& from, double turn_rad,
                                            const MotionLimits& limits);

/// Curves for all legs one after the other, yaw unwrapped, with turns to each leg's first heading.
std::vector<MinimumSnapCurve> FlyLegs(const std::vector<Leg>& legs, const MotionLimits& limits);

}  // namespace deepuav
