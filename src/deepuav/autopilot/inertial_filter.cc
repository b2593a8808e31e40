#include "deepuav/autopilot/inertial_filter.h"

#include "deepuav/autopilot/pose_noise.h"
#include "deepuav/sensors/standard_gravity.h"

namespace deepuav {
namespace {

constexpr int kPosition = InertialFilter::kPosition, kRotation = InertialFilter::kRotation,
              kVelocity = InertialFilter::kVelocity, kGyroscope = InertialFilter::kGyroscope,
              kAccelerometer = InertialFilter::kAccelerometer;

double Squared(double value) { return value * value; }

Matrix15d ProcessNoise(double dt_s, const InertialErrors& errors) {
  Eigen::Matrix<double, 15, 1> noise = Eigen::Matrix<double, 15, 1>::Zero();
  noise.segment<3>(kRotation).setConstant(dt_s * Squared(errors.gyroscope_density));
  noise.segment<3>(kVelocity).setConstant(dt_s * Squared(errors.accelerometer_density));
  noise.segment<3>(kGyroscope).setConstant(dt_s * Squared(errors.gyroscope_walk));
  noise.segment<3>(kAccelerometer).setConstant(dt_s * Squared(errors.accelerometer_walk));
  return noise.asDiagonal();
}

}  // namespace

void Integrate(const ImuSample& sample, int64_t until_ns, const InertialErrors& errors,
               InertialFilter* filter) {
  const double dt_s = 1e-9 * static_cast<double>(until_ns - filter->time_ns);
  const Eigen::Vector3d turn = dt_s * (sample.angular_velocity - filter->gyroscope_bias);
  const Eigen::Vector3d force_body = sample.specific_force - filter->accelerometer_bias;
  // As the body lies in the middle of the time.
  const Eigen::Quaterniond middle = filter->local_from_body.rotation() * RotationExp(0.5 * turn);
  const Eigen::Matrix3d axes = middle.toRotationMatrix();
  const Eigen::Vector3d acceleration =
      axes * force_body + kStandardGravity_m_s2 * Eigen::Vector3d::UnitZ();

  Matrix15d transition = Matrix15d::Identity();
  transition.block<3, 3>(kPosition, kVelocity) = dt_s * Eigen::Matrix3d::Identity();
  transition.block<3, 3>(kRotation, kRotation) = RotationExp(-turn).toRotationMatrix();
  transition.block<3, 3>(kRotation, kGyroscope) = -dt_s * Eigen::Matrix3d::Identity();
  transition.block<3, 3>(kVelocity, kRotation) = -dt_s * axes * Skew(force_body);
  transition.block<3, 3>(kVelocity, kAccelerometer) = -dt_s * axes;
  filter->covariance =
      transition * filter->covariance * transition.transpose() + ProcessNoise(dt_s, errors);

  const Eigen::Vector3d step = dt_s * filter->velocity_local + 0.5 * dt_s * dt_s * acceleration;
  filter->local_from_body = SE3(filter->local_from_body.rotation() * RotationExp(turn),
                                filter->local_from_body.translation() + step);
  filter->velocity_local += dt_s * acceleration;
  filter->time_ns = until_ns;
}

void Correct(const SE3& local_from_body, const Matrix6d& noise, InertialFilter* filter) {
  const PoseUpdate<15> update(filter->covariance, noise);
  const Eigen::Matrix<double, 15, 1> step =
      update.gain * PoseResidual(filter->local_from_body, local_from_body);
  filter->local_from_body = MovedBy(filter->local_from_body, step.head<6>());
  filter->velocity_local += step.segment<3>(kVelocity);
  filter->gyroscope_bias += step.segment<3>(kGyroscope);
  filter->accelerometer_bias += step.segment<3>(kAccelerometer);
  filter->covariance = update.posterior;
}

void MoveFrame(const SE3& local_from_body, const Matrix6d& noise, InertialFilter* filter) {
  const Eigen::Quaterniond turn =
      local_from_body.rotation() * filter->local_from_body.rotation().conjugate();
  filter->local_from_body = local_from_body;
  filter->velocity_local = turn * filter->velocity_local;
  Matrix15d turned = Matrix15d::Identity();
  turned.block<3, 3>(kVelocity, kVelocity) = turn.toRotationMatrix();
  filter->covariance = turned * filter->covariance * turned.transpose();
  // Where it is is what the pose says, whatever was known before.
  filter->covariance.topRows<6>().setZero();
  filter->covariance.leftCols<6>().setZero();
  filter->covariance.topLeftCorner<6, 6>() = noise;
}

}  // namespace deepuav
