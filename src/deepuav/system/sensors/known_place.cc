#include "deepuav/system/sensors/known_place.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// Pairs of keyframes whose distances together hold the scale of a map.
constexpr int kDistances = 20;

/// Of one of so many factors that together have this standard deviation.
double PerSigma(double sigma_of_mean, size_t count) {
  return 1 / (sigma_of_mean * std::sqrt(static_cast<double>(count)));
}

/// That the first two of the axes, of the map's world, are level.
void AddLevels(const Map& map, const std::vector<KeyframeId>& keyframes,
               const Eigen::Matrix3d& axes_world, double sigma_rad, MapFactors* factors) {
  const double per_sigma = PerSigma(sigma_rad, keyframes.size());
  for (const KeyframeId id : keyframes) {
    const Eigen::Matrix3d axes_cam = map.At(id).cam_from_world.RotationMatrix() * axes_world;
    for (int axis = 0; axis < 2; ++axis)
      factors->levels.push_back({id, {.per_sigma = per_sigma, .axis_cam = axes_cam.col(axis)}});
  }
}

void AddHeadings(const Map& map, const std::vector<KeyframeId>& keyframes,
                 const OrientationPrior& known, MapFactors* factors) {
  const Eigen::Vector3d north_world = known.local_from_world.conjugate() * Eigen::Vector3d::UnitY();
  const double per_sigma = PerSigma(known.heading_sigma_rad, keyframes.size());
  for (const KeyframeId id : keyframes) {
    const Eigen::Vector3d north_cam = map.At(id).cam_from_world.rotation() * north_world;
    factors->levels.push_back({id, {0, per_sigma, north_cam, Eigen::Vector3d::UnitX()}});
  }
}

/// Of pairs of keyframes along the path.
void AddDistances(const Map& map, const std::vector<KeyframeId>& keyframes, double scale_sigma,
                  MapFactors* factors) {
  const size_t pairs = std::min<size_t>(kDistances, keyframes.size() - 1);
  const double share_sigma = scale_sigma * std::sqrt(static_cast<double>(pairs));
  for (size_t k = 0; k < pairs; ++k) {
    const KeyframeId first = keyframes[k * (keyframes.size() - 1) / pairs];
    const KeyframeId second = keyframes[(k + 1) * (keyframes.size() - 1) / pairs];
    const double distance = (map.At(second).cam_from_world.InverseTranslation() -
                             map.At(first).cam_from_world.InverseTranslation())
                                .norm();
    if (distance > 0)
      factors->distances.push_back({first, second, {0, 0, distance, 1 / (share_sigma * distance)}});
  }
}

}  // namespace

double Contradiction(const Georeference& by_fixes, const MetricPrior& known) {
  const auto sigmas = [](double difference, double sigma, double known_sigma) {
    return std::abs(difference) / std::hypot(sigma, known_sigma);
  };
  const double scale = std::log(by_fixes.local_from_world.scale());
  double most = sigmas(scale, by_fixes.scale_sigma(), known.scale_sigma);
  const Eigen::Vector3d up = by_fixes.local_from_world.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d turn =  // By which the fixes tilt the map.
      std::atan2(up.head<2>().norm(), up.z()) * Eigen::Vector2d(-up.y(), up.x()).stableNormalized();
  for (int axis = 0; axis < 2; ++axis) {
    const double sigma = std::sqrt(by_fixes.covariance(kTurn + axis, kTurn + axis));
    most = std::max(most, sigmas(turn[axis], sigma, known.tilt_sigma_rad));
  }
  return most;
}

double Contradiction(const Georeference& by_fixes, const OrientationPrior& known) {
  const Eigen::AngleAxisd turn(by_fixes.local_from_world.rotation() *
                               known.local_from_world.conjugate());
  const Eigen::Vector3d difference = turn.angle() * turn.axis();
  const Eigen::Vector3d sigma(known.tilt_sigma_rad, known.tilt_sigma_rad, known.heading_sigma_rad);
  Eigen::Matrix3d covariance = by_fixes.covariance.block<3, 3>(kTurn, kTurn);
  covariance.diagonal() += sigma.cwiseAbs2();
  return std::sqrt(difference.dot(covariance.llt().solve(difference)));
}

MapFactors FactorsOf(const PlacePriors& known, const Map& map,
                     const std::vector<KeyframeId>& keyframes, double level_sigma_rad) {
  MapFactors factors;
  if (known.metric) {
    AddLevels(map, keyframes, Eigen::Matrix3d::Identity(), known.metric->tilt_sigma_rad, &factors);
    AddDistances(map, keyframes, known.metric->scale_sigma, &factors);
  } else if (known.orientation) {
    const Eigen::Quaterniond world_from_local = known.orientation->local_from_world.conjugate();
    AddLevels(map, keyframes, world_from_local.toRotationMatrix(),
              known.orientation->tilt_sigma_rad, &factors);
  } else {
    const double per_sigma = PerSigma(level_sigma_rad, keyframes.size());
    for (const KeyframeId id : keyframes) factors.levels.push_back({id, {.per_sigma = per_sigma}});
  }
  if (known.orientation) AddHeadings(map, keyframes, *known.orientation, &factors);
  return factors;
}

}  // namespace deepuav
