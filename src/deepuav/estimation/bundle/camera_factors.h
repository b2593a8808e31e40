#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/geometry/se3.h"

namespace deepuav {

// What other sensors say of the cameras of a bundle problem, beside its reprojections. Each factor
// has one error, in standard deviations, which both its cost and its linearisation are made from.

/// A point fixed to a camera was measured to be at a position of the world.
struct PositionFactor {
  int camera = 0;
  Eigen::Vector3d point_cam = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d per_sigma =
      Eigen::Vector3d::Zero();  ///< 1 / standard deviation; 0: not measured.
};

/// The world's z rose by so much from a point fixed to one camera to a point fixed to another.
struct HeightStepFactor {
  int first_camera = 0, second_camera = 0;
  Eigen::Vector3d first_point_cam = Eigen::Vector3d::Zero();
  Eigen::Vector3d second_point_cam = Eigen::Vector3d::Zero();
  double step_world = 0;
  double per_sigma = 0;
};

/// An axis of the camera lies in a plane of the world, that of x and y or another.
struct LevelFactor {
  int camera = 0;
  double per_sigma = 0;  ///< 1 / radian
  Eigen::Vector3d axis_cam = Eigen::Vector3d::UnitX();
  Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();
};

/// Two cameras are so far apart.
struct DistanceFactor {
  int first_camera = 0, second_camera = 0;
  double distance_world = 0;
  double per_sigma = 0;
};

struct CameraFactors {
  std::vector<PositionFactor> positions;
  std::vector<HeightStepFactor> height_steps;
  std::vector<LevelFactor> levels;
  std::vector<DistanceFactor> distances;

  bool empty() const {
    return positions.empty() && height_steps.empty() && levels.empty() && distances.empty();
  }
};

using Vector1d = Eigen::Matrix<double, 1, 1>;
using Matrix16d = Eigen::Matrix<double, 1, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

/// The errors at poses `cam_from_world`, and where asked for their Jacobians by the twist
/// [translation; rotation] that moves a pose from the left.
Eigen::Vector3d PositionError(const PositionFactor& factor, const SE3& cam_from_world,
                              Matrix36d* jacobian = nullptr);
Vector1d HeightStepError(const HeightStepFactor& factor, const SE3& first_from_world,
                         const SE3& second_from_world, Matrix16d* first_jacobian = nullptr,
                         Matrix16d* second_jacobian = nullptr);
Vector1d LevelError(const LevelFactor& factor, const SE3& cam_from_world,
                    Matrix16d* jacobian = nullptr);
/// Cameras at one place have no Jacobian.
Vector1d DistanceError(const DistanceFactor& factor, const SE3& first_from_world,
                       const SE3& second_from_world, Matrix16d* first_jacobian = nullptr,
                       Matrix16d* second_jacobian = nullptr);

/// Throws Error for a factor of a camera that is not one of `cameras`, or that is not finite.
void CheckCameraFactors(const CameraFactors& factors, int cameras);

/// The sum of the factors' Huber losses at the poses.
double CameraFactorCost(const CameraFactors& factors, const std::vector<SE3>& cam_from_world);

/// A block of the normal equations that two cameras share.
struct CameraPairBlock {
  int row = 0, column = 0;  ///< Free cameras, row > column.
  Matrix6d block = Matrix6d::Zero();
};

/// The factors' part of the normal equations. `free_of_camera` gives a camera's place among those
/// that move, -1 for one that does not.
class CameraFactorLinearisation {
 public:
  explicit CameraFactorLinearisation(const std::vector<int>& free_of_camera)
      : free_of_camera_(free_of_camera) {}

  void Compute(const CameraFactors& factors, const std::vector<SE3>& cam_from_world,
               std::vector<Matrix6d>* camera_camera, std::vector<Vector6d>* camera_gradient,
               std::vector<CameraPairBlock>* camera_pair) const;

 private:
  const std::vector<int>& free_of_camera_;
};

/// The pairs of free cameras that share a factor, by column, then row; each once.
std::vector<CameraPairBlock> CameraPairs(const CameraFactors& factors,
                                         const std::vector<int>& free_of_camera);

}  // namespace deepuav
