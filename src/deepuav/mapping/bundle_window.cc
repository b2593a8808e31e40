#include "deepuav/mapping/bundle_window.h"

#include <algorithm>
#include <set>

#include "deepuav/mapping/map_factors.h"

namespace deepuav {
namespace {

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

}  // namespace

BundleWindow MakeBundleWindow(const Map& map, const std::vector<KeyframeId>& free,
                              const Pinhole& pinhole) {
  BundleWindow window;
  window.problem.pinhole = pinhole;
  window.landmarks = LandmarksSeenBy(map, free);
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
      const Keypoint& keypoint =
          map.At(o.keyframe).features().keypoints[static_cast<size_t>(o.keypoint)];
      window.problem.observations.push_back({static_cast<int>(camera - window.keyframes.begin()),
                                             static_cast<int>(l), keypoint.px.cast<double>(),
                                             keypoint.sigma_px});
    }
  }
  return window;
}

namespace {

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

BundleReport AdjustTwice(Map* map, const std::vector<KeyframeId>& free, Pinhole* pinhole,
                         const BundleOptions& options, const std::function<bool()>& stop,
                         const MapFactors* factors) {
  BundleReport report;
  const double focal_guess_px = pinhole->fx;
  for (int run = 0; run < 2; ++run) {
    BundleWindow window = MakeBundleWindow(*map, free, *pinhole);
    window.problem.focal_guess_px = focal_guess_px;
    if (factors) AddFactors(*factors, &window);
    report = AdjustBundle(&window.problem, options, stop);
    *pinhole = window.problem.pinhole;
    WriteBack(window, map);
    if (stop && stop()) break;  // What is not yet adjusted tells no outliers.
    RemoveOutliers(report, window, map);
  }
  for (LandmarkId id : LandmarksSeenBy(*map, free)) map->UpdateViewRange(id);
  return report;
}

}  // namespace

BundleReport AdjustWindow(Map* map, const std::vector<KeyframeId>& free, const Pinhole& pinhole,
                          const BundleOptions& options, const std::function<bool()>& stop) {
  Pinhole unchanged = pinhole;
  return AdjustTwice(map, free, &unchanged, options, stop, nullptr);
}

BundleReport AdjustMap(Map* map, Pinhole* pinhole, const BundleOptions& options,
                       const std::function<bool()>& stop, const MapFactors* factors) {
  std::vector<KeyframeId> all;
  map->keyframes().ForEach([&all](const Keyframe& keyframe) { all.push_back(keyframe.id); });
  return AdjustTwice(map, all, pinhole, options, stop, factors);
}

}  // namespace deepuav
