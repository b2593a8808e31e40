#include "deepuav/tracking/keyframe_decision.h"

#include <algorithm>
#include <numbers>

#include "deepuav/base/option_check.h"
#include "deepuav/geometry/triangulation.h"

namespace deepuav {
namespace {

double MeanParallaxDeg(const LocatedFrame& located, const LocalMap& local_map) {
  const LocalKeyframe& reference = local_map.keyframes[static_cast<size_t>(located.reference)];
  const Eigen::Vector3d centre = located.cam_from_world.InverseTranslation();
  const Eigen::Vector3d reference_centre = reference.cam_from_world.InverseTranslation();
  double sum = 0;
  for (const LocatedFrame::Seen& seen : located.seen) {
    sum += ParallaxAngle(centre, reference_centre,
                         local_map.landmarks[static_cast<size_t>(seen.landmark)].position_world);
  }
  return sum / std::max<double>(1, static_cast<double>(located.seen.size())) * 180 /
         std::numbers::pi;
}

}  // namespace

void KeyframeOptions::Check() const { CheckOptions("keyframes", *this); }

bool NeedsKeyframe(const LocatedFrame& located, const LocalMap& local_map,
                   int frames_since_keyframe, const KeyframeOptions& options) {
  if (frames_since_keyframe < options.min_gap_frames) return false;
  const std::vector<int>& landmarks =
      local_map.keyframes[static_cast<size_t>(located.reference)].landmarks;
  const auto of_reference =
      std::count_if(landmarks.begin(), landmarks.end(), [](int l) { return l >= 0; });
  if (static_cast<int>(located.seen.size()) < options.min_matches) return true;
  if (located.reference_shared < options.min_shared_ratio * static_cast<double>(of_reference))
    return true;
  return MeanParallaxDeg(located, local_map) > options.max_parallax_deg;
}

}  // namespace deepuav
