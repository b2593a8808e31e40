#include "deepuav/survey/track_surfaces.h"

#include <cmath>
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

/// What one view sees of the points.
class ViewSurface {
 public:
  ViewSurface(const SE3& cam_from_world, double focal_px)
      : cam_from_world_(cam_from_world),
        axis_world_(cam_from_world.rotation().conjugate() * Eigen::Vector3d::UnitZ()),
        focal_px_(focal_px) {}

  /// Nothing behind the view.
  std::optional<SurfacePoint> See(const Eigen::Vector3d& point_world,
                                  const Eigen::Matrix3d& noise) const {
    const Eigen::Vector3d point = cam_from_world_ * point_world;
    if (!(point.z() > 0)) return std::nullopt;
    const double depth_sigma = std::sqrt(axis_world_.dot(noise * axis_world_)) / focal_px_;
    return SurfacePoint{point.head<2>() / point.z(), 1 / point.z(),
                        depth_sigma / (point.z() * point.z())};
  }
  Eigen::Vector3d ToWorld(const Eigen::Vector3d& normal_cam) const {
    return cam_from_world_.rotation().conjugate() * normal_cam;
  }

 private:
  const SE3& cam_from_world_;
  const Eigen::Vector3d axis_world_;
  const double focal_px_;
};

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
    const ViewSurface surface(*state.cam_from_world[v], focal_px);
    std::vector<SurfacePoint> seen;
    std::vector<std::pair<size_t, SurfacePoint>> asked;
    for (const int track : tracks.of_keypoint[v]) {
      if (track < 0 || !state.points[static_cast<size_t>(track)]) continue;
      const auto t = static_cast<size_t>(track);
      const auto point = surface.See(*state.points[t], noise[t]);
      if (!point) continue;
      seen.push_back(*point);
      if (view_of_track[t] == view) asked.emplace_back(t, *point);
    }
    if (asked.empty()) return;
    const SurfaceNormals fits(std::move(seen), focal_px, options);
    for (const auto& [t, point] : asked) normals[t] = surface.ToWorld(fits.At(point));
  });
  return normals;
}

}  // namespace deepuav
