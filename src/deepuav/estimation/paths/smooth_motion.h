#pragma once

#include <Eigen/Core>
#include <span>

#include "deepuav/geometry/se3.h"
#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

/// How unsteadily a camera moves: spectral densities of white noise on its acceleration, about each
/// axis (Barfoot et al. 2014, "Batch continuous-time trajectory estimation").
struct MotionNoise {
  double travel = 0;  ///< Of its centre, in the world's axes: units of the map^2 / s^3.
  double turn = 0;    ///< In the camera's axes: rad^2 / s^3.

  /// Finite and above 0.
  bool usable() const;
};

/// A camera at a moment and how it moves there.
struct MovingCamera {
  Eigen::Quaterniond world_from_cam = Eigen::Quaterniond::Identity();
  Eigen::Vector3d centre_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_world_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_cam_rad_per_s = Eigen::Vector3d::Zero();

  MovingCamera() = default;
  explicit MovingCamera(const SE3& cam_from_world)
      : world_from_cam(cam_from_world.rotation().conjugate()),
        centre_world(cam_from_world.InverseTranslation()) {}

  SE3 CamFromWorld() const {
    return {world_from_cam.conjugate(), -(world_from_cam.conjugate() * centre_world)};
  }
};

/// The order of a MovingCamera's twelve parameters; orientations are turned from the right, about
/// the camera's axes.
enum MovingCameraPart {
  kCentreAt = 0,
  kOrientationAt = 3,
  kVelocityAt = 6,
  kTurnAt = 9,
  kMovingCameraSize = 12
};
using MovingCameraStep = Eigen::Matrix<double, kMovingCameraSize, 1>;
using MovingCameraMatrix = Eigen::Matrix<double, kMovingCameraSize, kMovingCameraSize>;

MovingCamera Moved(const MovingCamera& camera, const MovingCameraStep& step);

/// By how far the second camera is not where the first would have come at a steady pace, in
/// standard deviations: centre and velocity, then orientation and turning. With the Jacobians by
/// the parameters of both where asked for.
MovingCameraStep SmoothMotionError(const MovingCamera& first, const MovingCamera& second,
                                   double between_s, const MotionNoise& noise,
                                   MovingCameraMatrix* by_first = nullptr,
                                   MovingCameraMatrix* by_second = nullptr);

/// The noise that a path shows: by how much its pace changes from one step to the next. Steps
/// longer than `max_step_s` are left out; not usable where fewer than `min_changes` remain.
MotionNoise MeasureMotionNoise(std::span<const TimedPose> path, double max_step_s, int min_changes);

}  // namespace deepuav
