#pragma once

#include <Eigen/Cholesky>

#include "deepuav/autopilot/body_pose.h"

namespace deepuav {

/// How far an image's pose is trusted.
struct PoseTrust {
  double least_position_sigma_m = 1e-3;
  double least_rotation_sigma_rad = 5e-4;
  double unknown_position_sigma_m = 0.05;  ///< Of poses that come without covariance.
  double unknown_rotation_sigma_rad = 0.02;
};

/// Of a vector with three linear parts and three angular ones.
Matrix6d DiagonalOf(double linear_sigma, double angular_sigma);

/// Of a pose's position in the local axes and its rotation about the body's.
Matrix6d NoiseOf(const BodyPose& pose, const PoseTrust& trust);

/// From what was predicted to what was found: in the local axes, and about the body's.
Vector6d PoseResidual(const SE3& predicted, const SE3& found);

/// The pose that is so far from another, as PoseResidual has it.
SE3 MovedBy(const SE3& pose, const Vector6d& step);

/// What a pose tells of a state of which it is the first six: a Kalman filter's update.
template <int kStates>
struct PoseUpdate {
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  PoseUpdate(const Covariance& prior, const Matrix6d& noise) {
    const Eigen::LLT<Matrix6d> innovation(Matrix6d(prior.template topLeftCorner<6, 6>() + noise));
    gain = innovation.solve(prior.template topRows<6>()).transpose();
    // Joseph's form, which stays positive.
    Covariance kept = Covariance::Identity();
    kept.template leftCols<6>() -= gain;
    const Covariance joseph = kept * prior * kept.transpose() + gain * noise * gain.transpose();
    posterior = 0.5 * (joseph + joseph.transpose());
  }

  Eigen::Matrix<double, kStates, 6> gain;
  Covariance posterior;
};

}  // namespace deepuav
