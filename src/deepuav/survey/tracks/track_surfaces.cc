#include "deepuav/survey/tracks/track_surfaces.h"

#include <utility>

#include "deepuav/base/parallel.h"
#include "deepuav/map/landmark_noise.h"

namespace deepuav {
namespace {

/// As PositionInformation::Noise(), of the sights that count.
Eigen::Matrix3d PointNoise(const Track& track, size_t t, const ViewPixels& px,
                           const SurveyState& state) {
  PositionInformation information(*state.points[t]);
  for (size_t s = 0; s < track.sights.size(); ++s) {
    const auto view = static_cast<size_t>(track.sights[s].view);
    if (!state.agrees[t][s] || !state.cam_from_world[view]) continue;
    const SightPixel& pixel = px[view][static_cast<size_t>(track.sights[s].keypoint)];
    information.Add(*state.cam_from_world[view], pixel.NoiseWith(state.model_sigma_px));
  }
  return information.Noise();
}

}  // namespace

std::vector<std::optional<Eigen::Vector3d>> TrackNormals(const Tracks& tracks, const ViewPixels& px,
                                                         const SurveyState& state,
                                                         const std::vector<int>& view_of_track,
                                                         const SurfaceNormalOptions& options,
                                                         int threads) {
  std::vector<std::optional<Eigen::Vector3d>> normals(tracks.tracks.size());
  std::vector<Eigen::Matrix3d> noise(tracks.tracks.size());
  const double focal_px = state.lens.camera.pinhole.fx;
  for (size_t t = 0; t < tracks.tracks.size(); ++t) {
    if (state.points[t]) noise[t] = PointNoise(tracks.tracks[t], t, px, state);
  }
  // Each track is of one view: none writes what another does.
  ForEachInParallel(static_cast<int>(px.size()), threads, [&](int view) {
    const auto v = static_cast<size_t>(view);
    if (!state.cam_from_world[v]) return;
    const SE3& cam_from_world = *state.cam_from_world[v];
    std::vector<SurfacePoint> seen;
    std::vector<std::pair<size_t, SurfacePoint>> asked;
    for (const int track : tracks.of_keypoint[v]) {
      if (track < 0 || !state.points[static_cast<size_t>(track)]) continue;
      const auto t = static_cast<size_t>(track);
      const auto point = SeenBy(cam_from_world, *state.points[t], noise[t], focal_px);
      if (!point) continue;
      seen.push_back(*point);
      if (view_of_track[t] == view) asked.emplace_back(t, *point);
    }
    if (asked.empty()) return;
    const SurfaceNormals fits(std::move(seen), focal_px, options);
    const Eigen::Quaterniond world_from_cam = cam_from_world.rotation().conjugate();
    for (const auto& [t, point] : asked) normals[t] = world_from_cam * fits.At(point);
  });
  return normals;
}

}  // namespace deepuav
