#include "deepuav/map/local_map.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "deepuav/base/option_check.h"
#include "deepuav/map/landmark_noise.h"

namespace deepuav {
namespace {

/// The centre first, then its neighbours by shared landmarks, then theirs.
std::vector<KeyframeId> Neighbourhood(const Map& map, KeyframeId centre,
                                      const LocalMapOptions& options) {
  std::vector<KeyframeId> ids = {centre};
  std::set<KeyframeId> taken = {centre};
  for (size_t i = 0; i < ids.size() && static_cast<int>(ids.size()) < options.max_keyframes; ++i) {
    for (KeyframeId other :
         map.Covisible(ids[i], options.min_shared_landmarks, options.max_keyframes)) {
      if (static_cast<int>(ids.size()) >= options.max_keyframes) break;
      if (taken.insert(other).second) ids.push_back(other);
    }
  }
  return ids;
}

/// The landmarks of these keyframes, the nearest keyframes' first up to `max_landmarks`, by id.
class LandmarkOrder {
 public:
  LandmarkOrder(const Map& map, const std::vector<KeyframeId>& keyframes, int max_landmarks) {
    for (KeyframeId id : keyframes) {
      for (LandmarkId landmark : map.At(id).landmarks) {
        if (landmark.valid() && static_cast<int>(ids_.size()) < max_landmarks &&
            index_.try_emplace(landmark, -1).second) {
          ids_.push_back(landmark);
        }
      }
    }
    std::sort(ids_.begin(), ids_.end());
    for (size_t i = 0; i < ids_.size(); ++i) index_[ids_[i]] = static_cast<int>(i);
  }

  const std::vector<LandmarkId>& ids() const { return ids_; }

  /// -1 of a landmark that is not among them.
  int IndexOf(LandmarkId landmark) const {
    const auto place = index_.find(landmark);
    return place == index_.end() ? -1 : place->second;
  }

 private:
  std::vector<LandmarkId> ids_;
  std::unordered_map<LandmarkId, int> index_;
};

/// How far the image of one camera is turned against that of another, about the viewing direction.
double HeadingDifferenceRad(const SE3& a_from_world, const SE3& b_from_world) {
  const Eigen::Matrix3d b_from_a =
      (b_from_world.rotation() * a_from_world.rotation().conjugate()).toRotationMatrix();
  return std::abs(std::atan2(b_from_a(1, 0) - b_from_a(0, 1), b_from_a(0, 0) + b_from_a(1, 1)));
}

/// Which observation's descriptor stands for a landmark seen from the centre.
class DescriptorChoice {
 public:
  DescriptorChoice(const Map& map, KeyframeId centre, double max_heading_difference_rad)
      : map_(map),
        centre_from_world_(map.At(centre).cam_from_world),
        max_difference_rad_(max_heading_difference_rad) {}

  /// Its representative, unless that saw it turned too far to be recognised under the centre's
  /// heading and another did not.
  Observation Of(const Landmark& landmark) {
    Observation best = landmark.representative;
    double least = DifferenceRad(best.keyframe);
    if (least <= max_difference_rad_) return best;
    for (const Observation& observation : landmark.observations) {
      const double other = DifferenceRad(observation.keyframe);
      if (other < least) best = observation, least = other;
    }
    return best;
  }

 private:
  double DifferenceRad(KeyframeId keyframe) {
    const auto [known, is_new] = differences_rad_.try_emplace(keyframe, 0);
    if (is_new)
      known->second = HeadingDifferenceRad(map_.At(keyframe).cam_from_world, centre_from_world_);
    return known->second;
  }

  const Map& map_;
  const SE3 centre_from_world_;
  const double max_difference_rad_;
  std::unordered_map<KeyframeId, double> differences_rad_;
};

LocalLandmark CopyLandmark(const Landmark& landmark) {
  return {landmark.id, landmark.position_world, landmark.mean_view_direction, landmark.min_distance,
          landmark.max_distance};
}

int IndexOf(const std::vector<KeyframeId>& rising, KeyframeId id) {
  const auto place = std::lower_bound(rising.begin(), rising.end(), id);
  return place != rising.end() && *place == id ? static_cast<int>(place - rising.begin()) : -1;
}

/// Of those in the local map, the observation to look for from its centre.
void ChooseReference(const Map& map, const Landmark& landmark,
                     const std::vector<KeyframeId>& keyframes, const Eigen::Vector3d& centre_world,
                     const ReferenceViewOptions& options, LocalLandmark* local) {
  const Observation* reference = ReferenceObservation(
      map, landmark, centre_world,
      [&](const Observation& observation) { return IndexOf(keyframes, observation.keyframe) >= 0; },
      options);
  if (!reference) return;
  local->reference = IndexOf(keyframes, reference->keyframe);
  local->reference_measured = reference->measured;
}

LocalKeyframe CopyKeyframe(const Keyframe& keyframe, const LandmarkOrder& landmarks) {
  LocalKeyframe copy{
      keyframe.id, keyframe.cam_from_world, keyframe.scale,   keyframe.frame.features,
      {},          keyframe.frame.image,    keyframe.motion()};
  copy.landmarks.assign(keyframe.landmarks.size(), -1);
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i].valid()) copy.landmarks[i] = landmarks.IndexOf(keyframe.landmarks[i]);
  }
  return copy;
}

}  // namespace

void LocalMapOptions::Check() const {
  CheckOptions("mapping.local_map", *this);
  reference.Check();
}

std::shared_ptr<const LocalMap> MakeLocalMap(const Map& map, KeyframeId centre,
                                             const LocalMapOptions& options) {
  std::vector<KeyframeId> keyframes = Neighbourhood(map, centre, options);
  const LandmarkOrder landmarks(map, keyframes, options.max_landmarks);
  std::sort(keyframes.begin(), keyframes.end());

  auto local = std::make_shared<LocalMap>();
  local->map = map.id();
  local->centre =
      static_cast<int>(std::find(keyframes.begin(), keyframes.end(), centre) - keyframes.begin());
  local->descriptors = Descriptors(map.At(centre).features().descriptors.dimension());
  local->descriptors.Reserve(static_cast<int>(landmarks.ids().size()));
  local->landmarks.reserve(landmarks.ids().size());
  local->model_sigma_px = map.model_sigma_px();
  local->revision = map.revision();
  const Eigen::Vector3d centre_world = map.At(centre).cam_from_world.InverseTranslation();
  DescriptorChoice choice(map, centre, options.max_heading_difference_deg * M_PI / 180);
  for (LandmarkId id : landmarks.ids()) {
    const Landmark& landmark = map.At(id);
    local->landmarks.push_back(CopyLandmark(landmark));
    local->landmarks.back().position_noise = PositionNoise(map, landmark);
    local->landmarks.back().normal_world = landmark.SurfaceNormal();
    ChooseReference(map, landmark, keyframes, centre_world, options.reference,
                    &local->landmarks.back());
    const Observation described = choice.Of(landmark);
    local->descriptors.AppendFrom(map.At(described.keyframe).features().descriptors,
                                  described.keypoint);
  }
  for (KeyframeId id : keyframes) local->keyframes.push_back(CopyKeyframe(map.At(id), landmarks));
  return local;
}

}  // namespace deepuav
