#include "deepuav/looping/drift.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// Keyframes that hold the keyframe in its place.
std::set<KeyframeId> HeldTogether(const Map& map, KeyframeId id, int min_shared) {
  const Keyframe& keyframe = map.At(id);
  std::set<KeyframeId> together = keyframe.loops;
  together.insert(keyframe.children.begin(), keyframe.children.end());
  if (keyframe.parent.valid()) together.insert(keyframe.parent);
  for (const auto& [other, shared] : keyframe.covisible) {
    if (shared >= min_shared) together.insert(other);
  }
  return together;
}

double DegreesOf(double angle_rad) { return angle_rad * 180 / std::numbers::pi; }

}  // namespace

void DriftOptions::Check() const { CheckOptions("looping.drift", *this); }

double TravelBetween(const Map& map, KeyframeId from, KeyframeId to, int min_shared) {
  std::map<KeyframeId, double> travel = {{from, 0}};
  std::set<std::pair<double, KeyframeId>> open = {{0, from}};
  while (!open.empty()) {
    const auto [so_far, here] = *open.begin();
    if (here == to) return so_far;
    open.erase(open.begin());
    const SE3& here_from_world = map.At(here).cam_from_world;
    const double depth = map.MedianDepth(here);
    for (KeyframeId next : HeldTogether(map, here, min_shared)) {
      const SE3 next_from_here = map.At(next).cam_from_world * here_from_world.Inverse();
      const double there =
          so_far + next_from_here.translation().norm() + next_from_here.Angle() * depth;
      const auto known = travel.find(next);
      if (known != travel.end() && known->second <= there) continue;
      if (known != travel.end()) open.erase({known->second, next});
      travel[next] = there;
      open.insert({there, next});
    }
  }
  return std::numeric_limits<double>::infinity();
}

bool CanHaveDrifted(const Map& map, const LoopFinding& finding, const DriftOptions& options,
                    std::string* reason) {
  const Keyframe& keyframe = map.At(finding.tie.keyframe);
  const double travel =
      TravelBetween(map, finding.tie.keyframe, finding.tie.place, options.min_shared);
  const double views = travel / map.MedianDepth(keyframe.id);
  const SE3 new_cam_from_world = finding.place_from_map_world.MovePose(keyframe.cam_from_world);
  const SE3 new_from_old = new_cam_from_world * keyframe.cam_from_world.Inverse();
  const double moved =
      (new_cam_from_world.InverseTranslation() - keyframe.cam_from_world.InverseTranslation())
          .norm();
  const double scale = std::abs(std::log(finding.place_from_map_world.scale()));
  const double turn = new_from_old.Angle();
  const double turn_deg = DegreesOf(turn);
  const bool can = moved <= (options.per_travel + scale + turn) * travel &&
                   scale <= options.least_scale + options.scale_per_view * views &&
                   turn_deg <= options.least_turn_deg + options.turn_per_view_deg * views;
  if (!can && reason) {
    *reason = fmt::format(
        "the map cannot have drifted by {:.3g} of {:.3g} travelled ({:.0f} views), a scale of "
        "{:.3f} and {:.1f} degrees",
        moved, travel, views, finding.place_from_map_world.scale(), turn_deg);
  }
  return can;
}

}  // namespace deepuav
