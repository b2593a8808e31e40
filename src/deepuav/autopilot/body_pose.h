#pragma once

#include "deepuav/geometry/se3.h"
#include "deepuav/system/sensors/metric_from_map.h"

namespace deepuav {

/// Where the body (x forward, y right, z down) is in the local frame: metres, z down; x north where
/// the map is georeferenced, else the metric world's x.
struct BodyPose {
  SE3 local_from_body;
  /// Of [position in the local axes, m; rotation vector in the body's axes, rad].
  Matrix6d covariance = Matrix6d::Identity();
  bool covariance_is_known = false;
};

/// From the metres of a map, with z up, to the local frame.
SE3 LocalFromMetric(bool is_georeferenced);

/// What a pose in the local frame is uncertain by, as BodyPose::covariance, because the map's own
/// metres are.
Matrix6d CovarianceOfMetric(const MetricFromMap& metric, const SE3& local_from_body);

/// `information`: of cam_from_map's twist [translation; rotation], left-multiplied, in the map's
/// units; one that cannot be inverted says nothing of the covariance.
BodyPose BodyPoseOf(const SE3& cam_from_map, const Matrix6d& information,
                    const MetricFromMap& metric, const SE3& body_from_cam);

}  // namespace deepuav
