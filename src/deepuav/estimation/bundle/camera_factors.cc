#include "deepuav/estimation/bundle/camera_factors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {
namespace {

/// 95 % of the squared errors of one and of three dimensions lie below.
constexpr HuberLoss kLoss1{3.841}, kLoss3{7.815};

/// Where a point fixed to the camera lies in the world, and how it moves with the pose's twist.
Eigen::Vector3d WorldPoint(const Eigen::Vector3d& point_cam, const SE3& cam_from_world,
                           Matrix36d* jacobian) {
  const Eigen::Matrix3d world_from_cam = cam_from_world.RotationMatrix().transpose();
  if (jacobian) {
    jacobian->leftCols<3>() = -world_from_cam;
    jacobian->rightCols<3>() = world_from_cam * Skew(point_cam);
  }
  return world_from_cam * (point_cam - cam_from_world.translation());
}

/// A camera of a factor, and the factor's Jacobian by it.
template <int kRows>
struct Side {
  int free_camera;
  Eigen::Matrix<double, kRows, 6> jacobian;
};

template <int kRows>
void AddSide(const Side<kRows>& side, const Eigen::Matrix<double, kRows, 1>& error, double weight,
             std::vector<Matrix6d>* camera_camera, std::vector<Vector6d>* camera_gradient) {
  if (side.free_camera < 0) return;
  const auto at = static_cast<size_t>(side.free_camera);
  (*camera_camera)[at].noalias() += weight * side.jacobian.transpose() * side.jacobian;
  (*camera_gradient)[at].noalias() += weight * side.jacobian.transpose() * error;
}

CameraPairBlock& PairBlock(int row, int column, std::vector<CameraPairBlock>* blocks) {
  const auto before = [](const CameraPairBlock& a, const std::pair<int, int>& b) {
    return std::pair(a.column, a.row) < b;
  };
  return *std::lower_bound(blocks->begin(), blocks->end(), std::pair(column, row), before);
}

void CheckCamera(int camera, int cameras) {
  if (camera < 0 || camera >= cameras)
    throw Error("bundle problem: a factor is of camera {}: expected below {}", camera, cameras);
}

template <typename Factor>
void CheckPair(const char* name, const Factor& factor, double measured, int cameras) {
  CheckCamera(factor.first_camera, cameras);
  CheckCamera(factor.second_camera, cameras);
  if (factor.first_camera == factor.second_camera)
    throw Error("bundle problem: a {} leads from camera {} to itself", name, factor.first_camera);
  if (!std::isfinite(measured + factor.per_sigma))
    throw Error("bundle problem: a {} of camera {} is not finite", name, factor.first_camera);
}

/// The error of a factor of two cameras, whose sides are told apart by their Jacobians.
Vector1d PairError(const HeightStepFactor& factor, const SE3& first, const SE3& second,
                   Matrix16d* of_first = nullptr, Matrix16d* of_second = nullptr) {
  return HeightStepError(factor, first, second, of_first, of_second);
}
Vector1d PairError(const DistanceFactor& factor, const SE3& first, const SE3& second,
                   Matrix16d* of_first = nullptr, Matrix16d* of_second = nullptr) {
  return DistanceError(factor, first, second, of_first, of_second);
}

/// Calls `visit` with each factor of two cameras.
template <typename Visit>
void ForEachPair(const CameraFactors& factors, Visit&& visit) {
  for (const HeightStepFactor& factor : factors.height_steps) visit(factor);
  for (const DistanceFactor& factor : factors.distances) visit(factor);
}

}  // namespace

Eigen::Vector3d PositionError(const PositionFactor& factor, const SE3& cam_from_world,
                              Matrix36d* jacobian) {
  const Eigen::Vector3d point = WorldPoint(factor.point_cam, cam_from_world, jacobian);
  if (jacobian) *jacobian = factor.per_sigma.asDiagonal() * *jacobian;
  return factor.per_sigma.cwiseProduct(point - factor.position_world);
}

Vector1d HeightStepError(const HeightStepFactor& factor, const SE3& first_from_world,
                         const SE3& second_from_world, Matrix16d* first_jacobian,
                         Matrix16d* second_jacobian) {
  Matrix36d jacobian;
  const double first = WorldPoint(factor.first_point_cam, first_from_world, &jacobian).z();
  if (first_jacobian) *first_jacobian = -factor.per_sigma * jacobian.row(2);
  const double second = WorldPoint(factor.second_point_cam, second_from_world, &jacobian).z();
  if (second_jacobian) *second_jacobian = factor.per_sigma * jacobian.row(2);
  return Vector1d(factor.per_sigma * (second - first - factor.step_world));
}

Vector1d LevelError(const LevelFactor& factor, const SE3& cam_from_world, Matrix16d* jacobian) {
  const Eigen::Vector3d normal_cam = cam_from_world.RotationMatrix() * factor.normal_world;
  if (jacobian) {
    jacobian->leftCols<3>().setZero();
    jacobian->rightCols<3>() = factor.per_sigma * normal_cam.cross(factor.axis_cam).transpose();
  }
  return Vector1d(factor.per_sigma * normal_cam.dot(factor.axis_cam));
}

Vector1d DistanceError(const DistanceFactor& factor, const SE3& first_from_world,
                       const SE3& second_from_world, Matrix16d* first_jacobian,
                       Matrix16d* second_jacobian) {
  Matrix36d of_first, of_second;
  const Eigen::Vector3d between =
      WorldPoint(Eigen::Vector3d::Zero(), second_from_world, &of_second) -
      WorldPoint(Eigen::Vector3d::Zero(), first_from_world, &of_first);
  const Eigen::RowVector3d direction = between.stableNormalized().transpose();
  if (first_jacobian) *first_jacobian = -factor.per_sigma * direction * of_first;
  if (second_jacobian) *second_jacobian = factor.per_sigma * direction * of_second;
  return Vector1d(factor.per_sigma * (between.norm() - factor.distance_world));
}

void CheckCameraFactors(const CameraFactors& factors, int cameras) {
  for (const PositionFactor& factor : factors.positions) {
    CheckCamera(factor.camera, cameras);
    if (!factor.point_cam.allFinite() || !factor.position_world.allFinite() ||
        !factor.per_sigma.allFinite()) {
      throw Error("bundle problem: a measured position of camera {} is not finite", factor.camera);
    }
  }
  for (const HeightStepFactor& factor : factors.height_steps)
    CheckPair("height step", factor, factor.step_world, cameras);
  for (const DistanceFactor& factor : factors.distances)
    CheckPair("distance", factor, factor.distance_world, cameras);
  for (const LevelFactor& factor : factors.levels) {
    CheckCamera(factor.camera, cameras);
    if (!factor.axis_cam.allFinite() || !factor.normal_world.allFinite() ||
        !std::isfinite(factor.per_sigma)) {
      throw Error("bundle problem: a level of camera {} is not finite", factor.camera);
    }
  }
}

double CameraFactorCost(const CameraFactors& factors, const std::vector<SE3>& cam_from_world) {
  const auto pose = [&](int camera) -> const SE3& {
    return cam_from_world[static_cast<size_t>(camera)];
  };
  double cost = 0;
  for (const PositionFactor& factor : factors.positions)
    cost += kLoss3.Cost(PositionError(factor, pose(factor.camera)).squaredNorm());
  ForEachPair(factors, [&](const auto& factor) {
    cost += kLoss1.Cost(
        PairError(factor, pose(factor.first_camera), pose(factor.second_camera)).squaredNorm());
  });
  for (const LevelFactor& factor : factors.levels)
    cost += kLoss1.Cost(LevelError(factor, pose(factor.camera)).squaredNorm());
  return cost;
}

void CameraFactorLinearisation::Compute(const CameraFactors& factors,
                                        const std::vector<SE3>& cam_from_world,
                                        std::vector<Matrix6d>* camera_camera,
                                        std::vector<Vector6d>* camera_gradient,
                                        std::vector<CameraPairBlock>* camera_pair) const {
  const auto pose = [&](int camera) -> const SE3& {
    return cam_from_world[static_cast<size_t>(camera)];
  };
  const auto free = [&](int camera) { return free_of_camera_[static_cast<size_t>(camera)]; };
  for (CameraPairBlock& pair : *camera_pair) pair.block.setZero();
  for (const PositionFactor& factor : factors.positions) {
    Side<3> side{free(factor.camera), {}};
    const Eigen::Vector3d error = PositionError(factor, pose(factor.camera), &side.jacobian);
    AddSide(side, error, kLoss3.Weight(error.squaredNorm()), camera_camera, camera_gradient);
  }
  for (const LevelFactor& factor : factors.levels) {
    Side<1> side{free(factor.camera), {}};
    const Vector1d error = LevelError(factor, pose(factor.camera), &side.jacobian);
    AddSide(side, error, kLoss1.Weight(error.squaredNorm()), camera_camera, camera_gradient);
  }
  ForEachPair(factors, [&](const auto& factor) {
    Side<1> first{free(factor.first_camera), {}}, second{free(factor.second_camera), {}};
    const Vector1d error = PairError(factor, pose(factor.first_camera), pose(factor.second_camera),
                                     &first.jacobian, &second.jacobian);
    const double weight = kLoss1.Weight(error.squaredNorm());
    AddSide(first, error, weight, camera_camera, camera_gradient);
    AddSide(second, error, weight, camera_camera, camera_gradient);
    if (first.free_camera < 0 || second.free_camera < 0) return;
    if (first.free_camera < second.free_camera) std::swap(first, second);
    PairBlock(first.free_camera, second.free_camera, camera_pair).block.noalias() +=
        weight * first.jacobian.transpose() * second.jacobian;
  });
}

std::vector<CameraPairBlock> CameraPairs(const CameraFactors& factors,
                                         const std::vector<int>& free_of_camera) {
  std::vector<std::pair<int, int>> pairs;
  ForEachPair(factors, [&](const auto& factor) {
    const auto [column, row] =
        std::minmax(free_of_camera[static_cast<size_t>(factor.first_camera)],
                    free_of_camera[static_cast<size_t>(factor.second_camera)]);
    if (column >= 0) pairs.emplace_back(column, row);
  });
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  std::vector<CameraPairBlock> blocks;
  for (const auto& [column, row] : pairs) blocks.push_back({row, column, Matrix6d::Zero()});
  return blocks;
}

}  // namespace deepuav
