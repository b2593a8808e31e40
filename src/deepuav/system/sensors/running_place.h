#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/geometry/geo_point.h"
#include "deepuav/inertial/alignment/running_alignment.h"
#include "deepuav/system/sensors/georeferencing.h"

namespace deepuav {

/// Where a map lies on Earth, as far as is known while the run goes on.
struct PlacedWorld {
  Sim3 local_from_world;  ///< Metres east, north and up of...
  GeoPoint origin;        ///< ...this.
  /// Of turn and shift from the left and the logarithm of the scale, as of Georeference.
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  double position_sigma_m = 0;  ///< Of the camera, horizontally.
  int fixes = 0;                ///< By which.

  double scale_sigma() const { return std::sqrt(covariance(kLogScale, kLogScale)); }
};

/// Finds a map's place on Earth by fixes while a camera flies. What was told once stays until what
/// is found later is surer or contradicts it, so that the world does not shake. Thread-compatible.
class RunningPlace {
 public:
  /// What there is to find it by.
  struct Evidence {
    Trajectory path;
    std::vector<GnssFix> fixes;
    GeoPoint origin;
    std::optional<MetricWorld> metric;                       ///< By an inertial sensor.
    Eigen::Vector3d camera_world = Eigen::Vector3d::Zero();  ///< Where the camera is now.
  };

  /// `gnss`: the receiver; its fixes don't count.
  RunningPlace(const GnssStream& gnss, const SensorUseOptions& options);

  /// Says what is new, if anything; what was told before, about another origin, is.
  std::optional<PlacedWorld> Find(const Evidence& evidence);

  bool has_told() const { return told_.has_value(); }
  /// Why the latest try found nothing, for a person; empty where it did, or none was made.
  const std::string& refusal() const { return refusal_; }

 private:
  GeoreferenceAttempt Attempt(const Trajectory& path, const std::vector<LocalFix>& fixes,
                              const PlacePriors& known) const;
  /// With what an inertial sensor says, unless the fixes contradict it.
  GeoreferenceAttempt Attempt(const Evidence& evidence, const std::vector<LocalFix>& fixes) const;
  bool IsNews(const Georeference& found, const Eigen::Vector3d& camera_world) const;
  PlacedWorld Told(const Eigen::Vector3d& camera_world) const;

  const Eigen::Vector3d antenna_cam_m_;
  const ClockPrior clock_;
  const GnssNoise noise_;
  const GeoreferenceOptions options_;
  std::optional<Georeference> told_;
  GeoPoint origin_;  ///< Of what was told.
  std::string refusal_;
};

}  // namespace deepuav
