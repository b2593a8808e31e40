#include "deepuav/survey/tracks/track_measurement.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "deepuav/base/intervals.h"
#include "deepuav/patches/patch_measurement.h"
#include "deepuav/survey/tracks/track_surfaces.h"

namespace deepuav {
namespace {

/// The sights of one point that count, and from where they see it.
struct SeenPoint {
  Eigen::Vector3d position_world;
  Eigen::Vector3d normal_world;  ///< Of its surface; until that is known, the mean direction
                                 ///< towards the views.
  std::vector<Track::Sight> sights;
  size_t reference = 0;  ///< Of these, the one nearest to the mean direction.
};

std::optional<SeenPoint> Seen(const std::vector<SurveyView>& views, const Track& track,
                              const Eigen::Vector3d& point, const std::vector<uint8_t>& agrees,
                              const SurveyState& state) {
  SeenPoint seen{point, Eigen::Vector3d::Zero(), {}, 0};
  std::vector<Eigen::Vector3d> directions;
  for (size_t s = 0; s < track.sights.size(); ++s) {
    const auto view = static_cast<size_t>(track.sights[s].view);
    if (!agrees[s] || !state.cam_from_world[view] || !views[view].HasImage()) continue;
    const Eigen::Vector3d to_view = state.cam_from_world[view]->InverseTranslation() - point;
    seen.sights.push_back(track.sights[s]);
    directions.push_back(to_view.normalized());
    seen.normal_world += directions.back();
  }
  if (seen.sights.size() < 2) return std::nullopt;
  for (size_t s = 1; s < directions.size(); ++s) {
    if (directions[s].dot(seen.normal_world) > directions[seen.reference].dot(seen.normal_world))
      seen.reference = s;
  }
  return seen;
}

/// Aligns the sights of points with their references.
class Measuring {
 public:
  Measuring(const PatchSurvey& survey, const SurveyState& state, ViewPixels* px)
      : survey_(survey), state_(state), px_(px) {}

  int Measure(const SeenPoint& seen) {
    const Track::Sight& reference = seen.sights[seen.reference];
    int measured = 0;
    for (size_t s = 0; s < seen.sights.size(); ++s)
      measured += s != seen.reference && MeasureBy(seen, reference, seen.sights[s]);
    if (measured == 0) return 0;
    const Keypoint& middle = KeypointOf(reference);
    PixelOf(reference) = {(survey_.keeps_distortion ? middle.image_px : middle.px).cast<double>(),
                          survey_.options.min_sigma_px, true};
    return measured + 1;
  }

 private:
  const SE3& PoseOf(const Track::Sight& sight) const {
    return *state_.cam_from_world[static_cast<size_t>(sight.view)];
  }
  const Frame& FrameOf(const Track::Sight& sight) const {
    return (*survey_.views)[static_cast<size_t>(sight.view)].frame;
  }
  std::shared_ptr<const ImagePyramid> ImageOf(const Track::Sight& sight) const {
    return (*survey_.views)[static_cast<size_t>(sight.view)].Image();
  }
  const Keypoint& KeypointOf(const Track::Sight& sight) const {
    return FrameOf(sight).features->keypoints[static_cast<size_t>(sight.keypoint)];
  }
  SightPixel& PixelOf(const Track::Sight& sight) {
    return (*px_)[static_cast<size_t>(sight.view)][static_cast<size_t>(sight.keypoint)];
  }
  /// What was detected at a part of the size says so much less of where the patch is.
  PatchOptions OptionsFor(const Track::Sight& sight) {
    PatchOptions options = survey_.options;
    const double sigma_px = PixelOf(sight).noise.SigmaPx();
    if (PixelOf(sight).by_patch || sigma_px <= 1) return options;
    options.prior_sigma_px *= sigma_px;
    options.max_shift_px *= sigma_px;
    return options;
  }
  bool MeasureBy(const SeenPoint& seen, const Track::Sight& reference, const Track::Sight& sight) {
    const auto reference_px =
        survey_.camera.Undistort(KeypointOf(reference).image_px.cast<double>());
    if (!reference_px) return false;
    const SE3& reference_from_world = PoseOf(reference);
    const SurfacePatch patch{*reference_px, reference_from_world * seen.position_world,
                             reference_from_world.rotation() * seen.normal_world};
    const DetectedPixel start{KeypointOf(sight).image_px.cast<double>(),
                              KeypointOf(sight).px.cast<double>()};
    const auto aligned =
        AlignSurface(*ImageOf(reference), patch, PoseOf(sight) * reference_from_world.Inverse(),
                     *ImageOf(sight), start.image_px, survey_.camera, OptionsFor(sight));
    if (!aligned) return false;
    // The reference's pixel is its own by definition, but for what a patch can tell at best.
    const PixelNoise noise = aligned->noise.Plus(survey_.options.min_sigma_px);
    if (survey_.keeps_distortion) {
      PixelOf(sight) = {aligned->px, noise, true};
      return true;
    }
    const auto measured = Undistorted(aligned->px, noise, start, survey_.camera);
    if (measured) PixelOf(sight) = {measured->px.cast<double>(), measured->noise, true};
    return measured.has_value();
  }

  const PatchSurvey& survey_;
  const SurveyState& state_;
  ViewPixels* px_;
};

/// Seen from two views a point hides most of their errors.
constexpr int kMinSightsToJudge = 3;

void AppendResiduals(const Track& track, size_t t, const ViewPixels& px, const SurveyState& state,
                     std::vector<AdjustedResidual>* residuals) {
  const auto count = std::ranges::count(state.agrees[t], uint8_t{1});
  if (!state.points[t] || count < kMinSightsToJudge) return;
  const double redundancy = 1 - 1.5 / static_cast<double>(count);
  for (size_t s = 0; s < track.sights.size(); ++s) {
    const auto view = static_cast<size_t>(track.sights[s].view);
    const SightPixel& pixel = px[view][static_cast<size_t>(track.sights[s].keypoint)];
    if (!state.agrees[t][s] || !pixel.by_patch) continue;
    const Eigen::Vector3d point =
        state.InCamera(*state.points[t], track.sights[s].view, pixel.px.y());
    if (point.z() <= 0) continue;
    residuals->push_back({state.lens.camera.Project(point) - pixel.px, pixel.noise, redundancy});
  }
}

}  // namespace

std::vector<Eigen::Vector3d> ViewVelocities(const std::vector<SurveyView>& views,
                                            const SurveyState& state) {
  struct Station {
    Timestamp time;
    Eigen::Vector3d centre_world;
    size_t view;
  };
  std::vector<Station> path;
  for (size_t v = 0; v < views.size(); ++v) {
    if (state.cam_from_world[v])
      path.push_back({views[v].frame.time, state.cam_from_world[v]->InverseTranslation(), v});
  }
  std::ranges::stable_sort(path, {}, &Station::time);
  const double longest_s = kLongestInMedianIntervals * MedianInterval_s(path);
  const auto are_neighbours = [&](size_t i, size_t k) {
    return k < path.size() && SecondsBetween(path[i].time, path[k].time) <= longest_s;
  };
  std::vector<Eigen::Vector3d> velocities(views.size(), Eigen::Vector3d::Zero());
  for (size_t i = 0; i < path.size(); ++i) {
    const Station& before = path[i > 0 && are_neighbours(i - 1, i) ? i - 1 : i];
    const Station& after = path[are_neighbours(i, i + 1) ? i + 1 : i];
    const double seconds = SecondsBetween(before.time, after.time);
    if (seconds > 0)
      velocities[path[i].view] = (after.centre_world - before.centre_world) / seconds;
  }
  return velocities;
}

double ModelSigmaPx(const Tracks& tracks, const ViewPixels& px, const SurveyState& state,
                    const ModelNoiseOptions& options) {
  std::vector<AdjustedResidual> residuals;
  for (size_t t = 0; t < tracks.tracks.size(); ++t)
    AppendResiduals(tracks.tracks[t], t, px, state, &residuals);
  if (std::ssize(residuals) < options.min_residuals) return state.model_sigma_px;
  return EstimateModelSigma(residuals, options);
}

int MeasureTracks(const PatchSurvey& survey, const Tracks& tracks, const SurveyState& state,
                  ViewPixels* px) {
  int measured = 0;
  if (!survey.options.enabled) return measured;
  std::vector<std::optional<SeenPoint>> points(tracks.tracks.size());
  std::vector<int> reference_view(points.size(), -1);
  for (size_t t = 0; t < points.size(); ++t) {
    if (!state.points[t]) continue;
    points[t] = Seen(*survey.views, tracks.tracks[t], *state.points[t], state.agrees[t], state);
    if (points[t]) reference_view[t] = points[t]->sights[points[t]->reference].view;
  }
  std::vector<std::optional<Eigen::Vector3d>> normals(points.size());
  if (survey.surface.enabled)
    normals = TrackNormals(tracks, *px, state, reference_view, survey.surface, survey.threads);
  Measuring measuring(survey, state, px);
  for (size_t t = 0; t < points.size(); ++t) {
    if (!points[t]) continue;
    if (normals[t]) points[t]->normal_world = *normals[t];
    measured += measuring.Measure(*points[t]);
  }
  return measured;
}

}  // namespace deepuav
