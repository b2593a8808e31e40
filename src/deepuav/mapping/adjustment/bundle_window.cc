#include "deepuav/mapping/adjustment/bundle_window.h"

#include <algorithm>
#include <set>
#include <utility>

#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/mapping/adjustment/map_factors.h"

namespace deepuav {
std::vector<LandmarkId> LandmarksSeenBy(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<LandmarkId> landmarks;
  for (KeyframeId id : keyframes) {
    for (LandmarkId landmark : map.At(id).landmarks) {
      if (landmark.valid()) landmarks.push_back(landmark);
    }
  }
  std::sort(landmarks.begin(), landmarks.end());
  landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  return landmarks;
}

BundleWindow MakeBundleWindow(const Map& map, const std::vector<KeyframeId>& free,
                              const Pinhole& pinhole) {
  return MakeBundleWindow(map, free, LandmarksSeenBy(map, free), pinhole);
}

BundleWindow MakeBundleWindow(const Map& map, const std::vector<KeyframeId>& free,
                              std::vector<LandmarkId> landmarks, const Pinhole& pinhole) {
  BundleWindow window;
  window.problem.pinhole = pinhole;
  window.landmarks = std::move(landmarks);
  std::set<KeyframeId> involved(free.begin(), free.end());
  const std::set<KeyframeId> adjusted = involved;
  for (LandmarkId id : window.landmarks) {
    for (const Observation& o : map.At(id).observations) involved.insert(o.keyframe);
  }
  window.keyframes.assign(involved.begin(), involved.end());
  for (KeyframeId id : window.keyframes) {
    window.problem.cam_from_world.push_back(map.At(id).cam_from_world);
    window.problem.camera_fixed.push_back(!adjusted.contains(id) || !map.At(id).parent.valid());
  }
  for (size_t l = 0; l < window.landmarks.size(); ++l) {
    const Landmark& landmark = map.At(window.landmarks[l]);
    window.problem.landmarks_world.push_back(landmark.position_world);
    for (const Observation& o : landmark.observations) {
      const auto camera =
          std::lower_bound(window.keyframes.begin(), window.keyframes.end(), o.keyframe);
      window.problem.observations.push_back({static_cast<int>(camera - window.keyframes.begin()),
                                             static_cast<int>(l), o.measured.px.cast<double>(),
                                             o.measured.NoiseWith(map.model_sigma_px())});
    }
  }
  return window;
}

void RemoveOutliers(const BundleReport& report, const BundleWindow& window, Map* map) {
  for (size_t i = 0; i < report.outlier.size(); ++i) {
    if (!report.outlier[i]) continue;
    const LandmarkId landmark =
        window.landmarks[static_cast<size_t>(window.problem.observations[i].landmark)];
    if (!map->Contains(landmark)) continue;
    map->RemoveObservation(
        window.keyframes[static_cast<size_t>(window.problem.observations[i].camera)], landmark);
  }
}

void WriteBack(const BundleWindow& window, Map* map) {
  const bool measures_scale = !window.problem.factors.positions.empty();
  if (measures_scale) MoveWithScale(window, map);
  for (size_t k = 0; k < window.keyframes.size() && !measures_scale; ++k) {
    if (!window.problem.camera_fixed[k])
      map->SetPose(window.keyframes[k], window.problem.cam_from_world[k]);
  }
  for (size_t l = 0; l < window.landmarks.size(); ++l) {
    if (!map->Contains(window.landmarks[l])) continue;
    map->SetPosition(window.landmarks[l], window.problem.landmarks_world[l]);
  }
}

namespace {

/// Seen from two views a landmark hides most of their errors.
constexpr size_t kMinObservationsToJudge = 3;

std::vector<AdjustedResidual> ResidualsOf(const Map& map, const Landmark& landmark,
                                          const Pinhole& pinhole) {
  std::vector<AdjustedResidual> residuals;
  const double redundancy = 1 - 1.5 / static_cast<double>(landmark.observations.size());
  for (const Observation& o : landmark.observations) {
    const Eigen::Vector3d point = map.At(o.keyframe).cam_from_world * landmark.position_world;
    if (!o.measured.by_patch || !InFrontOfCamera(point)) continue;
    residuals.push_back(
        {pinhole.Project(point) - o.measured.px.cast<double>(), o.measured.noise, redundancy});
  }
  return residuals;
}

}  // namespace

void UpdateModelSigma(Map* map, const std::vector<KeyframeId>& keyframes, const Pinhole& pinhole,
                      const ModelNoiseOptions& options) {
  std::vector<AdjustedResidual> residuals;
  for (LandmarkId id : LandmarksSeenBy(*map, keyframes)) {
    const Landmark& landmark = map->At(id);
    if (landmark.observations.size() < kMinObservationsToJudge) continue;
    for (const AdjustedResidual& residual : ResidualsOf(*map, landmark, pinhole))
      residuals.push_back(residual);
  }
  if (static_cast<int>(residuals.size()) < options.min_residuals) return;
  std::vector<AdjustedResidual> some;
  const size_t step = residuals.size() / static_cast<size_t>(options.max_residuals) + 1;
  for (size_t i = 0; i < residuals.size(); i += step) some.push_back(residuals[i]);
  const double known = map->model_sigma_px();
  map->SetModelSigma(known + options.weight * (EstimateModelSigma(some, options) - known));
}

}  // namespace deepuav
