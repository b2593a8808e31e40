#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/geo_point.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

/// How wrong fixes are where their receiver does not say it, and how long an error lasts.
struct GnssNoise {
  double horizontal_sigma_m = 1.5;
  double vertical_sigma_m = 3;
  double correlation_s = 60;        ///< In which the correlation of the errors falls to 1/e.
  double carrier_sigma_m = 0.1;     ///< Who states less has corrections (RTK, PPK).
  double level_flight_sigma_m = 5;  ///< Without altitudes the flight is taken to be this level.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("horizontal_sigma_m", horizontal_sigma_m, "m",
          "standard deviation, east and north, of fixes that state none", Between(0.001, 10'000));
    visit("vertical_sigma_m", vertical_sigma_m, "m", "the same, up", Between(0.001, 10'000));
    visit("correlation_s", correlation_s, "s",
          "in which the correlation of a receiver's errors falls to 1/e", Between(0, 1e6));
    visit(
        "carrier_sigma_m", carrier_sigma_m, "m",
        "fixes that mostly state less, east and north, are by the carrier's phase with corrections "
        "(RTK, PPK): their errors do not last",
        Between(0, 10'000));
    visit("level_flight_sigma_m", level_flight_sigma_m, "m",
          "how level a flight is taken to be whose fixes have no altitude", Between(0.001, 10'000));
  }
};

/// A fix in metres east, north and up.
struct LocalFix {
  Timestamp time;
  Eigen::Vector3d position_m;
  Eigen::Vector3d sigma_m;
  bool sigma_is_stated = false;
};

/// The fixes about the origin, by growing time. Those without altitude are at its height.
std::vector<LocalFix> LocalFixes(const std::vector<GnssFix>& fixes, const GeoPoint& origin,
                                 const GnssNoise& noise);

/// Where the antenna was measured to be, and where the path has the camera then.
struct PositionOnPath {
  TimedPose camera;  ///< On the camera's clock, in the map's world.
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();  ///< Of the camera, map units a second.
  Eigen::Vector3d position_m;
  Eigen::Vector3d sigma_m;
  bool sigma_is_stated = false;
};

/// The measured positions that lie on the path: of path and fixes, what comes less often is taken
/// as it is and the other interpolated at its times, in gaps of at most `max_gap_s` or of three
/// times its own median interval. `clock_offset_s` is added to the fixes' times.
std::vector<PositionOnPath> PlaceOnPath(const Trajectory& path, const std::vector<LocalFix>& fixes,
                                        double clock_offset_s, double max_gap_s);

/// The fixes' positions at growing `times`; offset and gaps as for PlaceOnPath.
std::vector<std::optional<Eigen::Vector3d>> PositionsAt(const std::vector<Timestamp>& times,
                                                        const std::vector<LocalFix>& fixes,
                                                        double clock_offset_s, double max_gap_s);

}  // namespace deepuav
