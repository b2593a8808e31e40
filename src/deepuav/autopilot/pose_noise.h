#pragma once

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

}  // namespace deepuav
