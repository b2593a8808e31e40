#include "deepuav/autopilot/body_pose.h"

#include <Eigen/Cholesky>

namespace deepuav {

SE3 LocalFromMetric(bool is_georeferenced) {
  Eigen::Matrix3d rotation;
  if (is_georeferenced)  // From east, north, up to north, east, down.
    rotation << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  else  // Half a turn about x.
    rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  return {rotation, Eigen::Vector3d::Zero()};
}

Matrix6d CovarianceOfMetric(const MetricFromMap& metric, const SE3& local_from_body) {
  const Eigen::Vector3d& position = local_from_body.translation();
  Matrix6d covariance = Matrix6d::Zero();
  if (!metric.covariance) {
    covariance.topLeftCorner<3, 3>() =
        metric.scale_sigma * metric.scale_sigma * position * position.transpose();
    return covariance;
  }
  const Eigen::Matrix3d local_axes = LocalFromMetric(metric.origin.has_value()).RotationMatrix();
  const Eigen::Vector3d arm = position - local_axes * metric.metric_from_map.translation();
  Eigen::Matrix<double, 6, 7> jacobian = Eigen::Matrix<double, 6, 7>::Zero();
  jacobian.block<3, 3>(0, 0) = -Skew(arm) * local_axes;
  jacobian.block<3, 3>(0, 3) = local_axes;
  jacobian.block<3, 1>(0, 6) = arm;
  jacobian.block<3, 3>(3, 0) = local_from_body.RotationMatrix().transpose() * local_axes;
  return jacobian * *metric.covariance * jacobian.transpose();
}

BodyPose BodyPoseOf(const SE3& cam_from_map, const Matrix6d& information,
                    const MetricFromMap& metric, const SE3& body_from_cam) {
  const SE3 cam_from_metric = metric.metric_from_map.MovePose(cam_from_map);
  const SE3 local_from_cam = LocalFromMetric(metric.origin.has_value()) * cam_from_metric.Inverse();
  const SE3 cam_from_body = body_from_cam.Inverse();
  BodyPose pose;
  pose.local_from_body = local_from_cam * cam_from_body;
  const Eigen::LLT<Matrix6d> factor(information);
  if (!information.allFinite() || factor.info() != Eigen::Success) return pose;
  // Exp([rho; phi]) * cam_from_world moves the body by -(rho + phi x cam_from_body's translation)
  // and turns it by -phi, in the camera's axes; rho in the map's units.
  const Eigen::Matrix3d local_axes = local_from_cam.RotationMatrix();
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = -metric.metric_from_map.scale() * local_axes;
  jacobian.topRightCorner<3, 3>() = local_axes * Skew(cam_from_body.translation());
  jacobian.bottomRightCorner<3, 3>() = -body_from_cam.RotationMatrix();
  const Matrix6d covariance = jacobian * factor.solve(Matrix6d::Identity()) * jacobian.transpose();
  if (!covariance.allFinite()) return pose;
  pose.covariance = 0.5 * (covariance + covariance.transpose());
  pose.covariance_is_known = true;
  return pose;
}

}  // namespace deepuav
