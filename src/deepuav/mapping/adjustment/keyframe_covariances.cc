#include "deepuav/mapping/adjustment/keyframe_covariances.h"

#include <algorithm>
#include <optional>

#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/adjustment/bundle_window.h"
#include "deepuav/mapping/adjustment/map_factors.h"

namespace deepuav {
namespace {

/// A scale that is known by definition: exact beside what images tell.
constexpr double kExactScale = 1e-5;

/// The scale by the distance from the root to the keyframe farthest from it.
void HoldScale(const Map& map, double scale_sigma, BundleWindow* window) {
  std::vector<SE3>& poses = window->problem.cam_from_world;
  size_t root = 0, farthest = 0;
  for (size_t k = 0; k < window->keyframes.size(); ++k) {
    if (window->keyframes[k] == map.root()) root = k;
  }
  const auto distance = [&](size_t k) {
    return (poses[k].InverseTranslation() - poses[root].InverseTranslation()).norm();
  };
  for (size_t k = 0; k < poses.size(); ++k) {
    if (distance(k) > distance(farthest)) farthest = k;
  }
  if (!(distance(farthest) > 0)) return;
  const double sigma = std::max(scale_sigma, kExactScale) * distance(farthest);
  window->problem.factors.distances.push_back(
      {static_cast<int>(root), static_cast<int>(farthest), distance(farthest), 1 / sigma});
}

}  // namespace

KeyframeCovariances EstimateKeyframeCovariances(const Map& map, const Pinhole& pinhole,
                                                const BundleOptions& options,
                                                const MapFactors* factors, double scale_sigma) {
  BundleWindow window = MakeBundleWindow(map, AllKeyframes(map), pinhole);
  if (factors) AddFactors(*factors, &window);
  if (window.problem.factors.positions.empty()) HoldScale(map, scale_sigma, &window);
  const auto found = EstimateCameraCovariances(window.problem, options);
  KeyframeCovariances covariances;
  if (!found) return covariances;
  for (size_t k = 0; k < window.keyframes.size(); ++k)
    covariances.emplace(window.keyframes[k], (*found)[k]);
  return covariances;
}

}  // namespace deepuav
