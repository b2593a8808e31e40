#include "deepuav/system/sensors/fix_trial.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/estimation/solvers/damped_gauss_newton.h"

namespace deepuav {
namespace {

constexpr double kChiSquare = 5.991;  // 95 % of a 2-D error

/// A landmark as the keyframe measured it.
struct Sight {
  Eigen::Vector3d landmark_world;
  Eigen::Vector2d px;
  Whitening whitening;
};

std::vector<Sight> SightsOf(const Map& map, KeyframeId id) {
  std::vector<Sight> sights;
  for (const LandmarkId seen : map.At(id).landmarks) {
    if (!seen.valid()) continue;
    const Landmark& landmark = map.At(seen);
    const auto own = std::ranges::find(landmark.observations, id, &Observation::keyframe);
    if (own == landmark.observations.end()) continue;
    sights.push_back({landmark.position_world, own->measured.px.cast<double>(),
                      Whitening(own->measured.NoiseWith(map.model_sigma_px()))});
  }
  return sights;
}

class Trial {
 public:
  Trial(std::vector<Sight> sights, const PositionFactor& fix, const Pinhole& pinhole)
      : sights_(std::move(sights)), fix_(fix), pinhole_(pinhole) {}

  int AgreeingWith(const SE3& cam_from_world) const {
    return static_cast<int>(std::ranges::count_if(sights_, [&](const Sight& sight) {
      const Eigen::Vector3d point_cam = cam_from_world * sight.landmark_world;
      return InFrontOfCamera(point_cam) && ErrorOf(sight, point_cam).squaredNorm() <= kChiSquare;
    }));
  }

  NormalEquations<6> Linearise(const SE3& cam_from_world) const {
    const HuberLoss loss{kChiSquare};
    NormalEquations<6> equations;
    Matrix36d of_fix;
    const Eigen::Vector3d off = PositionError(fix_, cam_from_world, &of_fix);
    equations.hessian = of_fix.transpose() * of_fix;
    equations.gradient = of_fix.transpose() * off;
    equations.cost = off.squaredNorm();
    for (const Sight& sight : sights_) {
      const Eigen::Vector3d point_cam = cam_from_world * sight.landmark_world;
      if (!InFrontOfCamera(point_cam)) continue;
      const Eigen::Vector2d error = ErrorOf(sight, point_cam);
      const Matrix26d jacobian =
          sight.whitening * PoseJacobian(pinhole_.ProjectJacobian(point_cam), point_cam);
      const double weight = loss.Weight(error.squaredNorm());
      equations.hessian += weight * jacobian.transpose() * jacobian;
      equations.gradient += weight * jacobian.transpose() * error;
      equations.cost += loss.Cost(error.squaredNorm());
    }
    return equations;
  }

 private:
  Eigen::Vector2d ErrorOf(const Sight& sight, const Eigen::Vector3d& point_cam) const {
    return sight.whitening * Eigen::Vector2d(pinhole_.Project(point_cam) - sight.px);
  }

  const std::vector<Sight> sights_;
  const PositionFactor& fix_;
  const Pinhole& pinhole_;
};

}  // namespace

FixTrial TryFix(const Map& map, KeyframeId keyframe, const PositionFactor& fix,
                const Pinhole& pinhole) {
  const SE3& now = map.At(keyframe).cam_from_world;
  const Trial trial(SightsOf(map, keyframe), fix, pinhole);
  constexpr int kIterations = 30;
  const Eigen::Vector3d centre = fix.position_world - now.rotation().conjugate() * fix.point_cam;
  const SE3 at_fix = MinimiseDamped(
      SE3(now.rotation(), -(now.rotation() * centre)), kIterations,
      [&](const SE3& pose) { return trial.Linearise(pose); },
      [](const SE3& pose, const Vector6d& step) { return SE3::Exp(step) * pose; });
  return {at_fix, PositionError(fix, at_fix).norm(), trial.AgreeingWith(now),
          trial.AgreeingWith(at_fix)};
}

}  // namespace deepuav
