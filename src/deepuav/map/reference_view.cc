#include "deepuav/map/reference_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// How different a landmark looks from two places: 1 where angle or scale reach their bounds.
double Dissimilarity(const Eigen::Vector3d& to_a, const Eigen::Vector3d& to_b,
                     const ReferenceViewOptions& options) {
  const double angle = std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b));
  const double scale = std::abs(std::log(to_a.norm() / to_b.norm()));
  return std::max(angle / (options.max_angle_deg * std::numbers::pi / 180),
                  scale / std::log(options.max_scale_change));
}

Eigen::Vector3d ToView(const Map& map, const Landmark& landmark, KeyframeId keyframe) {
  return map.At(keyframe).cam_from_world.InverseTranslation() - landmark.position_world;
}

}  // namespace

void ReferenceViewOptions::Check() const { CheckOptions("mapping.reference", *this); }

const Observation* ReferenceObservation(const Map& map, const Landmark& landmark,
                                        const Eigen::Vector3d& centre_world,
                                        const std::function<bool(const Observation&)>& may_serve,
                                        const ReferenceViewOptions& options) {
  const Eigen::Vector3d to_centre = centre_world - landmark.position_world;
  const Observation* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.At(observation.keyframe);
    if (!keyframe.frame.image || !observation.measured.by_patch || !may_serve(observation))
      continue;
    const double difference = Dissimilarity(ToView(map, landmark, keyframe.id), to_centre, options);
    if (difference <= 1) return &observation;
    if (difference < least) nearest = &observation, least = difference;
  }
  return nearest;
}

const Observation* MiddleObservation(const Map& map, const Landmark& landmark,
                                     const ReferenceViewOptions& options) {
  const Observation* middle = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Observation& candidate : landmark.observations) {
    const Keyframe& keyframe = map.At(candidate.keyframe);
    if (!keyframe.frame.image || !candidate.measured.by_patch) continue;
    double sum = 0;
    for (const Observation& other : landmark.observations) {
      sum += Dissimilarity(ToView(map, landmark, candidate.keyframe),
                           ToView(map, landmark, other.keyframe), options);
    }
    if (sum < least) middle = &candidate, least = sum;
  }
  return middle;
}

bool LooksAlike(const Map& map, const Landmark& landmark, KeyframeId a, KeyframeId b,
                const ReferenceViewOptions& options) {
  return Dissimilarity(ToView(map, landmark, a), ToView(map, landmark, b), options) <= 1;
}

}  // namespace deepuav
