#include "deepuav/patches/surface_normals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr int kRounds = 8;
constexpr double kFirstRelativeNoise = 0.02;
/// Errors, in standard deviations, from which points count for less.
constexpr double kCauchyScale = 2;
constexpr double kSigmasOverMedian = 1.4826;  // Of the absolute error of a normal distribution.
/// Of the point's own depth, only so that the fit stays regular where it is alone.
constexpr double kWeakRelativeSigma = 1e3;

/// What the inverse depth of a plane that faces the camera gains along x and y.
Eigen::Vector2d FacingSlope(const SurfacePoint& point) {
  return point.inverse_depth * point.direction / (1 + point.direction.squaredNorm());
}

/// The slope at `point` of the inverse depth of those around it.
Eigen::Vector2d FitSlope(const SurfacePoint& point, const std::vector<const SurfacePoint*>& around,
                         const SurfaceNormalOptions& options) {
  const Eigen::Vector2d facing = FacingSlope(point);
  const Eigen::Vector3d prior(point.inverse_depth, facing.x(), facing.y());
  const Eigen::Vector3d prior_sigma =
      point.inverse_depth *
      Eigen::Vector3d(kWeakRelativeSigma, options.slope_sigma, options.slope_sigma);
  const Eigen::Vector3d prior_information = prior_sigma.array().square().inverse();
  Eigen::Vector3d plane = prior;  // Inverse depth at the point, and what it gains along x and y.
  double roughness = kFirstRelativeNoise * point.inverse_depth;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d information = prior_information.asDiagonal();
    Eigen::Vector3d sum = prior_information.cwiseProduct(prior);
    std::vector<double> errors;
    for (const SurfacePoint* other : around) {
      const Eigen::Vector2d offset = other->direction - point.direction;
      const Eigen::Vector3d of_plane(1, offset.x(), offset.y());
      const double error = other->inverse_depth - of_plane.dot(plane);
      const double variance = other->sigma * other->sigma + roughness * roughness;
      const double weight = 1 / (variance + error * error / (kCauchyScale * kCauchyScale));
      information += weight * of_plane * of_plane.transpose();
      sum += weight * other->inverse_depth * of_plane;
      errors.push_back(std::abs(error));
    }
    plane = information.ldlt().solve(sum);
    roughness = std::max(kSigmasOverMedian * Median(errors),
                         options.min_relative_noise * point.inverse_depth);
  }
  return plane.tail<2>();
}

}  // namespace

std::optional<SurfacePoint> SeenBy(const SE3& cam_from_world, const Eigen::Vector3d& point_world,
                                   const Eigen::Matrix3d& noise, double focal_px) {
  const Eigen::Vector3d point = cam_from_world * point_world;
  if (!(point.z() > 0)) return std::nullopt;
  const Eigen::Vector3d axis_world =
      cam_from_world.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  const double depth_sigma = std::sqrt(axis_world.dot(noise * axis_world)) / focal_px;
  return SurfacePoint{point.head<2>() / point.z(), 1 / point.z(),
                      depth_sigma / (point.z() * point.z())};
}

void SurfaceNormalOptions::Check() const { CheckOptions("mapping.surface", *this); }

SurfaceNormals::SurfaceNormals(std::vector<SurfacePoint> points, double focal_px,
                               const SurfaceNormalOptions& options)
    : points_(std::move(points)), focal_px_(focal_px), options_(options) {}

std::vector<const SurfacePoint*> SurfaceNormals::Around(const Eigen::Vector2d& direction) const {
  const double reach = options_.max_distance_px / focal_px_;
  std::vector<std::pair<double, size_t>> near;
  for (size_t i = 0; i < points_.size(); ++i) {
    const double distance = (points_[i].direction - direction).squaredNorm();
    if (distance <= reach * reach) near.push_back({distance, i});
  }
  const auto count = std::min(near.size(), static_cast<size_t>(options_.neighbours));
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  std::vector<const SurfacePoint*> nearest;
  for (size_t i = 0; i < count; ++i) nearest.push_back(&points_[near[i].second]);
  return nearest;
}

Eigen::Vector3d SurfaceNormals::At(const SurfacePoint& point) const {
  std::vector<const SurfacePoint*> around;
  if (options_.enabled) around = Around(point.direction);
  const Eigen::Vector2d slope =
      around.empty() ? FacingSlope(point) : FitSlope(point, around, options_);
  // The plane's points X satisfy n X = 1 with n = (slope, inverse depth where x and y are 0).
  const Eigen::Vector3d normal(slope.x(), slope.y(),
                               point.inverse_depth - slope.dot(point.direction));
  return -normal.normalized();
}

}  // namespace deepuav
