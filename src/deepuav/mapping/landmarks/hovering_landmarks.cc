#include "deepuav/mapping/landmarks/hovering_landmarks.h"

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "deepuav/base/option_check.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

/// A landmark as a view sees it. What lies on a plane has an inverse depth that is linear in x and
/// y.
struct Sight {
  Eigen::Vector3d ray;  ///< x / z, y / z, 1
  double inverse_depth;
  LandmarkId landmark;
};

std::vector<Sight> SightsOf(const Map& map, const Keyframe& view) {
  std::vector<Sight> sights;
  for (const LandmarkId id : view.landmarks) {
    if (!id.valid()) continue;
    const Eigen::Vector3d point = view.cam_from_world * map.At(id).position_world;
    if (point.z() > 0) sights.push_back({point / point.z(), 1 / point.z(), id});
  }
  return sights;
}

/// Coefficients of the inverse depth by x, y and 1, through three of them.
std::optional<Eigen::Vector3d> PlaneThrough(const std::vector<Sight>& sights, Random* random) {
  Eigen::Matrix3d rays;
  Eigen::Vector3d inverse_depths;
  for (int i = 0; i < 3; ++i) {
    const Sight& sight =
        sights[static_cast<size_t>(random->Index(static_cast<int>(sights.size())))];
    rays.row(i) = sight.ray.transpose();
    inverse_depths[i] = sight.inverse_depth;
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(rays);
  if (!solver.isInvertible()) return std::nullopt;
  return solver.solve(inverse_depths);
}

int CountOn(const Eigen::Vector3d& plane, const std::vector<Sight>& sights, double max_ratio) {
  int count = 0;
  for (const Sight& sight : sights) {
    const double there = plane.dot(sight.ray);
    count += there > 0 && sight.inverse_depth < there * max_ratio &&
             there < sight.inverse_depth * max_ratio;
  }
  return count;
}

/// The plane that most lie on; nothing where that is not enough of them.
std::optional<Eigen::Vector3d> FindPlane(const std::vector<Sight>& sights,
                                         const HoveringOptions& options, Random* random) {
  if (static_cast<int>(sights.size()) < options.min_landmarks) return std::nullopt;
  const double max_ratio = std::exp(options.max_plane_error);
  std::optional<Eigen::Vector3d> best;
  int most = 0;
  for (int i = 0; i < options.samples; ++i) {
    const auto plane = PlaneThrough(sights, random);
    const int count = plane ? CountOn(*plane, sights, max_ratio) : 0;
    if (count <= most) continue;
    most = count;
    best = plane;
  }
  if (most < options.min_plane_share * static_cast<double>(sights.size())) return std::nullopt;
  return best;
}

struct Verdicts {
  int views = 0, hovers = 0;
};

/// A keyframe must keep enough that holds it.
void KeepHalfOfEachView(const Map& map, const std::vector<KeyframeId>& views,
                        std::set<LandmarkId>* hovering) {
  for (const KeyframeId id : views) {
    const Keyframe& view = map.At(id);
    int all = 0, hover = 0;
    for (const LandmarkId seen : view.landmarks) {
      all += seen.valid();
      hover += seen.valid() && hovering->contains(seen);
    }
    if (2 * hover <= all) continue;
    for (const LandmarkId seen : view.landmarks) hovering->erase(seen);
  }
}

}  // namespace

void HoveringOptions::Check() const { CheckOptions("mapping.hovering", *this); }

std::set<LandmarkId> HoveringLandmarks(const Map& map, const std::vector<KeyframeId>& views,
                                       const HoveringOptions& options) {
  std::set<LandmarkId> hovering;
  if (!options.distrust) return hovering;
  std::map<LandmarkId, Verdicts> verdicts;
  for (const KeyframeId id : views) {
    const Keyframe& view = map.At(id);
    const std::vector<Sight> sights = SightsOf(map, view);
    Random random(static_cast<uint64_t>(view.id.value));
    const auto plane = FindPlane(sights, options, &random);
    for (const Sight& sight : sights) {
      const double there = plane ? plane->dot(sight.ray) : 0;
      Verdicts& of_landmark = verdicts[sight.landmark];
      ++of_landmark.views;
      of_landmark.hovers += there > 0 && there < options.max_depth_share * sight.inverse_depth;
    }
  }
  for (const auto& [landmark, of_landmark] : verdicts) {
    if (2 * of_landmark.hovers > of_landmark.views) hovering.insert(landmark);
  }
  KeepHalfOfEachView(map, views, &hovering);
  return hovering;
}

}  // namespace deepuav
