#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/sensors/georeference.h"
#include "deepuav/sensors/georeference_hypothesis.h"

namespace deepuav {

/// Weighted least squares about where a path lies on Earth, with what is known beside the fixes: a
/// level camera or its attitudes, the receiver's clock, metres and level by an inertial sensor.
/// `per_sigma` of its steps: by position, one over the standard deviation to count with, by axis;
/// zero for an outlier.
class GeoreferenceRefinement {
 public:
  /// `positions`, placed with a clock offset of `placed_offset_s`, and `known` must outlive it.
  GeoreferenceRefinement(const PathPositions& positions, const Eigen::Vector3d& antenna_cam_m,
                         const ClockPrior& clock, double placed_offset_s,
                         const GeoreferenceOptions& options, const PlacePriors& known);

  /// The most probable estimate, from one that is nearly right.
  PathEstimate Solve(PathEstimate estimate, const std::vector<Eigen::Vector3d>& per_sigma) const;

  /// The inverse of the estimate's covariance, in the order of GeoreferenceParameter.
  Matrix8d Information(const PathEstimate& estimate,
                       const std::vector<Eigen::Vector3d>& per_sigma) const;

 private:
  struct Normal;

  Normal Linearise(const PathEstimate& estimate,
                   const std::vector<Eigen::Vector3d>& per_sigma) const;
  void AddPriors(const PathEstimate& estimate, Normal* normal) const;
  void AddLevels(const Sim3& local_from_world, Normal* normal) const;
  static void AddMetric(const MetricPrior& known, const Sim3& local_from_world, Normal* normal);
  static void AddOrientation(const OrientationPrior& known, const Sim3& local_from_world,
                             Normal* normal);
  static void AddUp(const Eigen::Vector3d& up, double sigma_rad, Normal* normal);

  const PathPositions& positions_;
  const Eigen::Vector3d antenna_cam_m_;
  const ClockPrior clock_;
  const double placed_offset_s_, level_sigma_;
  const PlacePriors& known_;
};

}  // namespace deepuav
