#include "deepuav/mapping/adjustment/map_factors.h"

#include <algorithm>
#include <map>
#include <optional>

#include "deepuav/base/median.h"

namespace deepuav {
namespace {

/// The keyframe's camera in the window; -1 where it is not there.
int CameraOf(const BundleWindow& window, KeyframeId keyframe) {
  const auto found = std::lower_bound(window.keyframes.begin(), window.keyframes.end(), keyframe);
  if (found == window.keyframes.end() || *found != keyframe) return -1;
  return static_cast<int>(found - window.keyframes.begin());
}

template <typename Factor>
void AddOfKeyframes(const std::vector<MapFactors::OfKeyframe<Factor>>& factors,
                    const BundleWindow& window, std::vector<Factor>* into) {
  for (const auto& [keyframe, factor] : factors) {
    const int camera = CameraOf(window, keyframe);
    if (camera < 0) continue;
    into->push_back(factor);
    into->back().camera = camera;
  }
}

template <typename Factor>
void AddOfTwo(const std::vector<MapFactors::OfTwo<Factor>>& factors, const BundleWindow& window,
              std::vector<Factor>* into) {
  for (const auto& [first, second, factor] : factors) {
    const int first_camera = CameraOf(window, first), second_camera = CameraOf(window, second);
    if (first_camera < 0 || second_camera < 0) continue;
    into->push_back(factor);
    into->back().first_camera = first_camera;
    into->back().second_camera = second_camera;
  }
}

/// By how much the distances of each camera to its landmarks have grown, in the median.
std::vector<double> GrowthOfScale(const BundleWindow& window, const Map& map) {
  std::vector<std::vector<double>> growth(window.keyframes.size());
  for (const BundleObservation& o : window.problem.observations) {
    const auto camera = static_cast<size_t>(o.camera), landmark = static_cast<size_t>(o.landmark);
    const double before = (map.At(window.keyframes[camera]).cam_from_world *
                           map.At(window.landmarks[landmark]).position_world)
                              .norm();
    const double after =
        (window.problem.cam_from_world[camera] * window.problem.landmarks_world[landmark]).norm();
    if (before > 0 && after > 0) growth[camera].push_back(after / before);
  }
  std::vector<double> medians;
  for (const std::vector<double>& of_camera : growth)
    medians.push_back(of_camera.empty() ? 1 : Median(of_camera));
  return medians;
}

}  // namespace

void AddFactors(const MapFactors& factors, BundleWindow* window) {
  CameraFactors& into = window->problem.factors;
  AddOfKeyframes(factors.positions, *window, &into.positions);
  AddOfKeyframes(factors.levels, *window, &into.levels);
  AddOfTwo(factors.height_steps, *window, &into.height_steps);
  AddOfTwo(factors.distances, *window, &into.distances);
  if (into.positions.empty()) return;
  std::fill(window->problem.camera_fixed.begin(), window->problem.camera_fixed.end(), 0);
}

void MoveWithScale(const BundleWindow& window, Map* map) {
  const std::vector<double> growth = GrowthOfScale(window, *map);
  for (size_t k = 0; k < window.keyframes.size(); ++k) {
    if (window.problem.camera_fixed[k]) continue;
    const SE3& old_cam_from_world = map->At(window.keyframes[k]).cam_from_world;
    const Sim3 grown(growth[k], Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero());
    map->Move(window.keyframes[k],
              Sim3(window.problem.cam_from_world[k].Inverse()) * grown * Sim3(old_cam_from_world));
    map->SetPose(window.keyframes[k], window.problem.cam_from_world[k]);
  }
}

}  // namespace deepuav
