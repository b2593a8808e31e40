#include "deepuav/mapping/landmarks/patch_observation.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "deepuav/features/readout_correction.h"
#include "deepuav/map/landmark_noise.h"
#include "deepuav/patches/patch_measurement.h"

namespace deepuav {
namespace {

DetectedPixel Detected(const Keyframe& keyframe, int keypoint, const Camera& camera) {
  const Keypoint& detected = keyframe.features().keypoints[static_cast<size_t>(keypoint)];
  const ReadoutMotion motion = keyframe.motion();
  return {detected.image_px.cast<double>(), PixelInRow(detected, motion, camera), motion};
}

SurfacePoint SeenFrom(const Keyframe& keyframe, const Landmark& landmark) {
  const Eigen::Vector3d point = keyframe.cam_from_world * landmark.position_world;
  return {point.head<2>() / point.z(), 1 / point.z()};
}

/// All landmarks that the keyframe sees.
std::vector<SurfacePoint> SurfacePoints(const Map& map, const Keyframe& keyframe, double focal_px) {
  const Eigen::Vector3d axis_world =
      keyframe.cam_from_world.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  std::vector<SurfacePoint> points;
  for (const LandmarkId id : keyframe.landmarks) {
    if (!id.valid()) continue;
    const Landmark& landmark = map.At(id);
    SurfacePoint point = SeenFrom(keyframe, landmark);
    if (!(point.inverse_depth > 0)) continue;
    const double depth_variance = axis_world.dot(PositionNoise(map, landmark) * axis_world);
    point.sigma = std::sqrt(depth_variance) / focal_px * point.inverse_depth * point.inverse_depth;
    points.push_back(point);
  }
  return points;
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
                   landmark.SurfaceNormal(), keyframe, Detected(keyframe, keypoint, camera_));
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

void PatchObserver::UpdateNormals(KeyframeId keyframe, Map* map) const {
  std::vector<LandmarkId> seen;
  for (const LandmarkId landmark : map->At(keyframe).landmarks) {
    if (landmark.valid()) seen.push_back(landmark);
  }
  UpdateNormals(keyframe, seen, map);
}

void PatchObserver::UpdateNormals(KeyframeId id, const std::vector<LandmarkId>& landmarks,
                                  Map* map) const {
  if (!options_.enabled || !surface_.enabled) return;
  const Keyframe& keyframe = map->At(id);
  const SurfaceNormals surface(SurfacePoints(*map, keyframe, camera_.pinhole.fx),
                               camera_.pinhole.fx, surface_);
  const Eigen::Quaterniond world_from_cam = keyframe.cam_from_world.rotation().conjugate();
  for (const LandmarkId landmark : landmarks) {
    const SurfacePoint point = SeenFrom(keyframe, map->At(landmark));
    if (point.inverse_depth > 0) map->SetNormal(landmark, world_from_cam * surface.At(point));
  }
}

void PatchObserver::RemeasureAll(Map* map) const {
  if (!options_.enabled) return;
  std::map<KeyframeId, std::vector<LandmarkId>> by_reference;
  map->landmarks().ForEach([&](const Landmark& landmark) {
    if (const Observation* middle = MiddleObservation(*map, landmark, reference_))
      by_reference[middle->keyframe].push_back(landmark.id);
  });
  for (const auto& [reference, landmarks] : by_reference) {
    UpdateNormals(reference, landmarks, map);
    for (const LandmarkId landmark : landmarks)
      Remeasure(map->At(landmark), map->At(reference), map);
  }
}

void PatchObserver::Remeasure(const Landmark& landmark, const Keyframe& reference, Map* map) const {
  const Observation& middle =
      *std::ranges::find(landmark.observations, reference.id, &Observation::keyframe);
  const PixelMeasurement by_definition{middle.measured.px, options_.min_sigma_px, true};
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
                                    landmark.SurfaceNormal(), keyframe, *start);
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
