#include "deepuav/autopilot/odometry_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace deepuav {
namespace {

constexpr double kNoRollNorYaw = 1e-3;  // The cosine of the pitch below which these are undefined.

double Squared(double value) { return value * value; }

/// How roll, pitch and yaw change with a rotation vector in the body's axes. NaN where the body
/// points straight up or down.
Eigen::Matrix3d EulerFromBodyRotation(const Eigen::Vector3d& roll_pitch_yaw) {
  const double sin_roll = std::sin(roll_pitch_yaw.x()), cos_roll = std::cos(roll_pitch_yaw.x());
  const double cos_pitch = std::cos(roll_pitch_yaw.y());
  Eigen::Matrix3d jacobian;
  if (std::abs(cos_pitch) < kNoRollNorYaw)
    return Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const double tan_pitch = std::tan(roll_pitch_yaw.y());
  jacobian << 1, sin_roll * tan_pitch, cos_roll * tan_pitch, 0, cos_roll, -sin_roll, 0,
      sin_roll / cos_pitch, cos_roll / cos_pitch;
  return jacobian;
}

Matrix6d PoseCovariance(const BodyMotion& motion, const MetricFromMap& metric) {
  Matrix6d jacobian = Matrix6d::Identity();
  jacobian.bottomRightCorner<3, 3>() =
      EulerFromBodyRotation(EulerAngles(motion.local_from_body.rotation()));
  const Matrix6d pose =
      motion.covariance.topLeftCorner<6, 6>() + CovarianceOfMetric(metric, motion.local_from_body);
  Matrix6d covariance = jacobian * pose * jacobian.transpose();
  // What is undefined says nothing of the position.
  covariance.topLeftCorner<3, 3>() = pose.topLeftCorner<3, 3>();
  return covariance;
}

Matrix6d VelocityCovariance(const BodyMotion& motion, const Eigen::Vector3d& velocity_body,
                            double scale_sigma) {
  Eigen::Matrix<double, 6, 12> jacobian = Eigen::Matrix<double, 6, 12>::Zero();
  jacobian.block<3, 3>(0, 3) = Skew(velocity_body);
  jacobian.block<3, 3>(0, 6) = motion.local_from_body.RotationMatrix().transpose();
  jacobian.block<3, 3>(3, 9).setIdentity();
  Matrix6d covariance = jacobian * motion.covariance * jacobian.transpose();
  covariance.topLeftCorner<3, 3>() +=
      Squared(scale_sigma) * velocity_body * velocity_body.transpose();
  return covariance;
}

bool IsFar(const SE3& a, const SE3& b, double distance_m, double angle_rad) {
  const SE3 move = a.Inverse() * b;
  return move.translation().norm() > distance_m || move.Angle() > angle_rad;
}

}  // namespace

Eigen::Vector3d EulerAngles(const Eigen::Quaterniond& rotation) {
  const Eigen::Matrix3d m = rotation.toRotationMatrix();
  return {std::atan2(m(2, 1), m(2, 2)), std::asin(std::clamp(-m(2, 0), -1.0, 1.0)),
          std::atan2(m(1, 0), m(0, 0))};
}

OdometryEstimator::OdometryEstimator(const SE3& body_from_cam, const OdometryOptions& options,
                                     std::unique_ptr<MotionPredictor> predictor)
    : body_from_cam_(body_from_cam), options_(options), predictor_(std::move(predictor)) {}

bool OdometryEstimator::IsOld(int64_t time_ns) const {
  return 1e-9 * static_cast<double>(time_ns - time_ns_) > options_.max_prediction_s;
}

bool OdometryEstimator::WorldMoved(const World& world, const LocatedImage& image,
                                   const BodyPose& pose) const {
  if (world.map != world_->map || world.revision != world_->revision) return true;
  if (world.metric.origin.has_value() != world_->metric.origin.has_value()) return true;
  const SE3 before =
      BodyPoseOf(image.cam_from_map, image.information, world_->metric, body_from_cam_)
          .local_from_body;
  return IsFar(before, pose.local_from_body, options_.least_jump_m, options_.least_jump_rad);
}

bool OdometryEstimator::IsElsewhere(const LocatedImage& image, const BodyPose& pose) const {
  if (image.time_ns <= time_ns_ || IsOld(image.time_ns)) return true;
  const std::optional<BodyMotion> expected = predictor_->At(image.time_ns);
  if (!expected) return false;
  const SE3 &there = expected->local_from_body, &here = pose.local_from_body;
  if (IsFar(there, here, options_.largest_step_m, options_.largest_step_rad)) return true;
  return IsFar(there, here, options_.least_jump_m, options_.least_jump_rad) &&
         (is_lost_ || !predictor_->Expects(image.time_ns, pose));
}

void OdometryEstimator::Add(const LocatedImage& image, const std::optional<MetricFromMap>& metric) {
  was_located_ = true;
  has_scale_ = metric.has_value();
  if (!metric) return;
  const BodyPose pose = BodyPoseOf(image.cam_from_map, image.information, *metric, body_from_cam_);
  World world{image.map, image.map_revision, *metric};
  const bool world_moved = world_ && WorldMoved(world, image, pose);
  const bool continues = world_ && image.time_ns > time_ns_ && !IsOld(image.time_ns);
  bool jumps = world_moved && continues;
  if (jumps) {
    predictor_->Jump(image.time_ns, pose);
  } else {
    jumps = world_ && IsElsewhere(image, pose);
    if (jumps) predictor_->Forget();
    predictor_->Add(image.time_ns, pose);
    jumps = jumps || MovesWhatWasTold();
  }
  if (jumps) {
    ++reset_counter_;
    told_.reset();  // What was told is counted.
  }
  world_ = std::move(world);
  time_ns_ = image.time_ns;
  landmarks_ = image.landmarks;
  is_lost_ = false;
}

Odometry OdometryEstimator::Describe(const BodyMotion& motion, int64_t time_ns) const {
  Odometry odometry;
  odometry.time_ns = time_ns;
  odometry.local_from_body = motion.local_from_body;
  odometry.velocity_body = motion.local_from_body.rotation().conjugate() * motion.velocity_local;
  odometry.turn_rate_body = motion.turn_rate_body;
  odometry.reset_counter = reset_counter_;
  const double share = static_cast<double>(landmarks_) / options_.full_quality_landmarks;
  odometry.quality = std::clamp(static_cast<int>(std::lround(100 * share)), 1, 100);
  const MetricFromMap& metric = world_->metric;
  if (motion.covariance_is_known) {
    odometry.pose_covariance = PoseCovariance(motion, metric);
    odometry.velocity_covariance =
        VelocityCovariance(motion, odometry.velocity_body, metric.scale_sigma);
  } else {
    odometry.pose_covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
    odometry.velocity_covariance = odometry.pose_covariance;
  }
  return odometry;
}

bool OdometryEstimator::MovesWhatWasTold() const {
  if (!told_) return false;
  const std::optional<BodyMotion> now = predictor_->At(told_->first);
  return now && IsFar(told_->second, now->local_from_body, options_.largest_step_m,
                      options_.largest_step_rad);
}

OdometryEstimator::Answer OdometryEstimator::At(int64_t time_ns) {
  Answer answer;
  if (!was_located_) return answer;
  if (!has_scale_) {
    answer.why = Silence::kNoScale;
    return answer;
  }
  answer.origin = world_->metric.origin;
  const bool is_old = IsOld(time_ns);
  const std::optional<BodyMotion> motion =
      is_old ? std::nullopt : predictor_->At(std::max(time_ns, time_ns_));
  if (!motion) {
    answer.why = is_lost_ ? Silence::kLost : Silence::kNoImage;
    return answer;
  }
  answer.why = Silence::kNone;
  answer.odometry = Describe(*motion, std::max(time_ns, time_ns_));
  told_ = {answer.odometry->time_ns, motion->local_from_body};
  return answer;
}

}  // namespace deepuav
