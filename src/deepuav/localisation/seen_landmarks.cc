#include "deepuav/localisation/seen_landmarks.h"

#include "deepuav/features/readout_correction.h"
#include "deepuav/map/landmark_noise.h"
#include "deepuav/patches/patch_measurement.h"

namespace deepuav {

PixelMeasurement SeenAtKeypoint(const Frame& frame, const LocalMap& local_map,
                                const LocatedFrame::Seen& seen,
                                const std::optional<SE3>& cam_from_world, const Camera& camera) {
  const Keypoint& keypoint = frame.features->keypoints[static_cast<size_t>(seen.keypoint)];
  if (!cam_from_world || frame.motion.travel.isZero(0)) return {keypoint.px, keypoint.sigma_px};
  const Eigen::Vector3d& landmark =
      local_map.landmarks[static_cast<size_t>(seen.landmark)].position_world;
  const Eigen::Vector2d px =
      PixelInMiddleRow(keypoint, frame.motion, camera, 1 / (*cam_from_world * landmark).z());
  return {px.cast<float>(), keypoint.sigma_px};
}

std::optional<PixelMeasurement> SeenByPatch(const Frame& frame, const LocalMap& local_map,
                                            const LocatedFrame::Seen& seen,
                                            const SE3& cam_from_world, const Camera& camera,
                                            const PatchOptions& options) {
  const LocalLandmark& landmark = local_map.landmarks[static_cast<size_t>(seen.landmark)];
  if (landmark.reference < 0) return std::nullopt;
  const LocalKeyframe& reference = local_map.keyframes[static_cast<size_t>(landmark.reference)];
  const SurfacePatch patch{landmark.reference_measured.px.cast<double>(),
                           reference.cam_from_world * landmark.position_world,
                           reference.cam_from_world.rotation() * landmark.normal_world,
                           reference.motion};
  const Keypoint& keypoint = frame.features->keypoints[static_cast<size_t>(seen.keypoint)];
  const DetectedPixel start{keypoint.image_px.cast<double>(),
                            PixelInRow(keypoint, frame.motion, camera), frame.motion};
  auto measured =
      MeasurePatch(*reference.image, patch, cam_from_world * reference.cam_from_world.Inverse(),
                   *frame.image, start, camera, options);
  if (measured) measured->noise = measured->noise + landmark.reference_measured.noise;
  return measured;
}

std::vector<PoseObservation> PoseObservations(const Frame& frame, const LocalMap& local_map,
                                              const std::vector<LocatedFrame::Seen>& seen,
                                              const std::optional<SE3>& cam_from_world,
                                              const Camera& camera) {
  std::vector<PoseObservation> observations;
  observations.reserve(seen.size());
  for (const LocatedFrame::Seen& s : seen) {
    const PixelMeasurement measured =
        s.measured ? *s.measured : SeenAtKeypoint(frame, local_map, s, cam_from_world, camera);
    const LocalLandmark& landmark = local_map.landmarks[static_cast<size_t>(s.landmark)];
    PixelNoise noise = measured.NoiseWith(local_map.model_sigma_px);
    if (cam_from_world) {
      noise = noise +
              ExpectedPixelNoise(landmark.position_noise, landmark.position_world, *cam_from_world);
    }
    observations.push_back({landmark.position_world, measured.px.cast<double>(), noise});
  }
  return observations;
}

}  // namespace deepuav
