#include "deepuav/mapping/patch_observation.h"

#include "deepuav/features/readout_correction.h"
#include "deepuav/patches/patch_measurement.h"

namespace deepuav {
namespace {

DetectedPixel Detected(const Keyframe& keyframe, int keypoint, const Camera& camera) {
  const Keypoint& detected = keyframe.features().keypoints[static_cast<size_t>(keypoint)];
  const ReadoutMotion motion = keyframe.motion();
  return {detected.image_px.cast<double>(), PixelInRow(detected, motion, camera), motion};
}

}  // namespace

std::optional<PixelMeasurement> PatchObserver::MeasureBy(const Keyframe& reference,
                                                         const PixelMeasurement& reference_measured,
                                                         const Eigen::Vector3d& position_world,
                                                         const Eigen::Vector3d& normal_world,
                                                         const Keyframe& keyframe,
                                                         const DetectedPixel& start) const {
  if (!options_.enabled || !reference.frame.image || !keyframe.frame.image) return std::nullopt;
  const SurfacePatch patch{reference_measured.px.cast<double>(),
                           reference.cam_from_world * position_world,
                           reference.cam_from_world.rotation() * normal_world, reference.motion()};
  auto measured = MeasurePatch(*reference.frame.image, patch,
                               keyframe.cam_from_world * reference.cam_from_world.Inverse(),
                               *keyframe.frame.image, start, camera_, options_);
  if (measured) measured->noise = measured->noise + reference_measured.noise;
  return measured;
}

std::optional<PixelMeasurement> PatchObserver::Measure(const Map& map, const Landmark& landmark,
                                                       KeyframeId id, int keypoint) const {
  const Keyframe& keyframe = map.At(id);
  const Observation* reference = ReferenceObservation(
      map, landmark, keyframe.cam_from_world.InverseTranslation(),
      [id](const Observation& observation) { return observation.keyframe != id; }, reference_);
  if (!reference) return std::nullopt;
  return MeasureBy(map.At(reference->keyframe), reference->measured, landmark.position_world,
                   landmark.mean_view_direction, keyframe, Detected(keyframe, keypoint, camera_));
}

std::optional<PixelMeasurement> PatchObserver::ReferenceMeasurement(
    const Keyframe& reference, int keypoint, const Eigen::Vector3d& position_world) const {
  if (!options_.enabled || !reference.frame.image) return std::nullopt;
  const Keypoint& detected = reference.features().keypoints[static_cast<size_t>(keypoint)];
  const double depth = (reference.cam_from_world * position_world).z();
  const Eigen::Vector2d px = PixelInMiddleRow(detected, reference.motion(), camera_, 1 / depth);
  return PixelMeasurement{px.cast<float>(), options_.min_sigma_px, true};
}

std::optional<PixelMeasurement> PatchObserver::MeasurePair(const Keyframe& reference,
                                                           int reference_keypoint,
                                                           const Eigen::Vector3d& position_world,
                                                           const Keyframe& keyframe,
                                                           int keypoint) const {
  const Eigen::Vector3d towards_reference =
      reference.cam_from_world.InverseTranslation() - position_world;
  const auto middle = ReferenceMeasurement(reference, reference_keypoint, position_world);
  if (!middle) return std::nullopt;
  return MeasureBy(reference, *middle, position_world, towards_reference, keyframe,
                   Detected(keyframe, keypoint, camera_));
}

void PatchObserver::RemeasureAll(Map* map) const {
  if (!options_.enabled) return;
  std::vector<LandmarkId> landmarks;
  map->landmarks().ForEach([&](const Landmark& landmark) { landmarks.push_back(landmark.id); });
  for (LandmarkId id : landmarks) Remeasure(map->At(id), map);
}

void PatchObserver::Remeasure(const Landmark& landmark, Map* map) const {
  const Observation* middle = MiddleObservation(*map, landmark, reference_);
  if (!middle) return;
  const Keyframe& reference = map->At(middle->keyframe);
  const PixelMeasurement by_definition{middle->measured.px, options_.min_sigma_px, true};
  const std::vector<Observation> observations = landmark.observations;
  for (const Observation& observation : observations) {
    const Keyframe& keyframe = map->At(observation.keyframe);
    if (keyframe.id == reference.id) {
      map->SetMeasurement(keyframe.id, landmark.id, by_definition);
      continue;
    }
    if (!LooksAlike(*map, landmark, reference.id, keyframe.id, reference_)) continue;
    const auto start = InRow(observation.measured, landmark, keyframe);
    if (!start) continue;
    const auto measured = MeasureBy(reference, by_definition, landmark.position_world,
                                    landmark.mean_view_direction, keyframe, *start);
    if (measured) map->SetMeasurement(keyframe.id, landmark.id, *measured);
  }
}

std::optional<DetectedPixel> PatchObserver::InRow(const PixelMeasurement& measured,
                                                  const Landmark& landmark,
                                                  const Keyframe& keyframe) const {
  const Eigen::Vector2d px = measured.px.cast<double>();
  const ReadoutMotion motion = keyframe.motion();
  const double inverse_depth = 1 / (keyframe.cam_from_world * landmark.position_world).z();
  const auto image_px = DistortInRow(camera_, px, motion, inverse_depth);
  if (!image_px) return std::nullopt;
  const double moment = RowMoment(image_px->y(), camera_.height);
  return DetectedPixel{*image_px, FromMiddleRow(camera_.pinhole, px, moment, motion, inverse_depth),
                       motion};
}

bool PatchObserver::AddObservation(Map* map, KeyframeId keyframe, int keypoint,
                                   LandmarkId landmark) const {
  return map->AddObservation(keyframe, keypoint, landmark,
                             Measure(*map, map->At(landmark), keyframe, keypoint));
}

void PatchObserver::Merge(Map* map, LandmarkId from, LandmarkId into) const {
  if (from == into) return;
  const std::vector<Observation> gained = map->At(from).observations;
  std::map<KeyframeId, PixelMeasurement> measured;
  for (const Observation& observation : gained) {
    const Keypoint& detected = map->At(observation.keyframe)
                                   .features()
                                   .keypoints[static_cast<size_t>(observation.keypoint)];
    measured[observation.keyframe] =
        Measure(*map, map->At(into), observation.keyframe, observation.keypoint)
            .value_or(PixelMeasurement{detected.px, detected.sigma_px});
  }
  map->MergeLandmark(from, into);
  for (const Observation& observation : gained) {
    const LandmarkId seen =
        map->At(observation.keyframe).landmarks[static_cast<size_t>(observation.keypoint)];
    if (seen == into)
      map->SetMeasurement(observation.keyframe, into, measured[observation.keyframe]);
  }
}

}  // namespace deepuav
