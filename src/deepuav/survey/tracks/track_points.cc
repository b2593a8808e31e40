#include "deepuav/survey/tracks/track_points.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <numeric>
#include <optional>

#include "deepuav/base/parallel.h"
#include "deepuav/geometry/triangulation.h"

namespace deepuav {
namespace {

/// While the lens is hardly known, errors are this much larger...
constexpr double kYoungLens = 3;
/// ...until so many photographs tell it.
constexpr int kYoungLensViews = 5;
/// Sights of a track from which it is triangulated, at most: further ones add little.
constexpr size_t kTriangulationSights = 7;

std::vector<const Track::Sight*> PosedSights(const std::vector<Track::Sight>& sights,
                                             const SurveyState& state) {
  std::vector<const Track::Sight*> posed;
  for (const Track::Sight& sight : sights) {
    if (state.Has(sight.view)) posed.push_back(&sight);
  }
  return posed;
}

/// So many of more, from the first to the last.
std::vector<const Track::Sight*> Spread(const std::vector<const Track::Sight*>& sights,
                                        size_t count) {
  std::vector<const Track::Sight*> spread;
  for (size_t i = 0; i < count; ++i)
    spread.push_back(sights[i * (sights.size() - 1) / (count - 1)]);
  return spread;
}

}  // namespace

double LensDoubt(const SurveyState& state) {
  const bool is_young = state.lens.is_refined && !state.HasViews(kYoungLensViews);
  return is_young ? kYoungLens : 1;
}

TrackPoints::TrackPoints(const Tracks* tracks, const ViewPixels* px, const SurveyOptions& options)
    : tracks_(tracks), px_(px), options_(options) {}

const SightPixel& TrackPoints::SightOf(const Track::Sight& sight) const {
  return (*px_)[static_cast<size_t>(sight.view)][static_cast<size_t>(sight.keypoint)];
}

const Eigen::Vector2d& TrackPoints::PixelOf(const Track::Sight& sight) const {
  return SightOf(sight).px;
}

double TrackPoints::MaxErrorPx(const SurveyState& state) const {
  return LensDoubt(state) * options_.max_error_px;
}

/// What was detected at a part of the size errs by as much more.
double TrackPoints::MaxSquaredErrorPx(const SightPixel& sight, const SurveyState& state) const {
  const double max_px = MaxErrorPx(state) * (sight.by_patch ? 1 : sight.noise.SigmaPx());
  return max_px * max_px;
}

/// In the photograph, which has a pose, and where a patch measured it as far as that may err.
bool TrackPoints::Agrees(const Eigen::Vector3d& point, const Track::Sight& sight,
                         const SurveyState& state) const {
  const SightPixel& seen = SightOf(sight);
  const Eigen::Vector3d point_cam = state.InCamera(point, sight.view, seen.px.y());
  if (!InFrontOfCamera(point_cam)) return false;
  const Eigen::Vector2d error_px = state.lens.camera.Project(point_cam) - seen.px;
  if (!(error_px.squaredNorm() < MaxSquaredErrorPx(seen, state))) return false;
  if (!seen.by_patch || state.model_sigma_px == 0) return true;
  const Whitening whitening(seen.NoiseWith(state.model_sigma_px));
  return (whitening * error_px).norm() < options_.max_patch_sigmas;
}

void TrackPoints::TriangulateIn(int view, SurveyState* state) const {
  for (const int track : tracks_->of_keypoint[static_cast<size_t>(view)]) {
    if (track < 0) continue;
    const auto t = static_cast<size_t>(track);
    if (state->points[t]) {
      JudgeTrack(t, state);
    } else {
      Triangulate(t, state);
    }
  }
}

/// The sum of what is counted, over all tracks at once: none changes what is known of another.
int TrackPoints::ForAllTracks(const std::function<int(size_t)>& count) const {
  constexpr int kParts = 32;
  std::array<int, kParts> sums{};
  const auto tracks = static_cast<int>(tracks_->tracks.size());
  ForEachInParallel(kParts, ThreadsOf(options_), [&](int part) {
    const PartOf range(tracks, part, kParts);
    int sum = 0;
    for (int t = range.first; t < range.last; ++t) sum += count(static_cast<size_t>(t));
    sums[static_cast<size_t>(part)] = sum;
  });
  return std::accumulate(sums.begin(), sums.end(), 0);
}

int TrackPoints::TriangulateAll(SurveyState* state) const {
  return ForAllTracks(
      [this, state](size_t t) { return !state->points[t] && Triangulate(t, state) ? 1 : 0; });
}

bool TrackPoints::Triangulate(size_t track, SurveyState* state) const {
  const auto sights = PosedSights(tracks_->tracks[track].sights, *state);
  std::optional<Eigen::Vector3d>& point = state->points[track];
  point = PointOf(std::span(sights).first(std::min(sights.size(), kTriangulationSights)), *state);
  // The first ones may have been taken where the camera hovered.
  if (!point && sights.size() > kTriangulationSights)
    point = PointOf(Spread(sights, kTriangulationSights), *state);
  if (point) JudgeTrack(track, state);
  return point.has_value();
}

/// Of the points that two of the sights give the one with which most of them agree.
std::optional<Eigen::Vector3d> TrackPoints::PointOf(std::span<const Track::Sight* const> sights,
                                                    const SurveyState& state) const {
  struct Eye {
    const SE3* cam_from_world;
    Eigen::Vector3d ray;
    Eigen::Vector3d centre;
    Eigen::Vector2d px;
    double max_squared;
  };
  std::vector<Eye> eyes;
  for (const Track::Sight* sight : sights) {
    const SE3& pose = *state.cam_from_world[static_cast<size_t>(sight->view)];
    if (const auto ray = state.lens.Ray(PixelOf(*sight)))
      eyes.push_back({&pose, *ray, pose.InverseTranslation(), PixelOf(*sight),
                      MaxSquaredErrorPx(SightOf(*sight), state)});
  }
  const double min_parallax = options_.min_parallax_deg * std::numbers::pi / 180;
  std::optional<Eigen::Vector3d> best;
  int most = 1;
  double widest = 0;
  for (size_t i = 0; i < eyes.size(); ++i) {
    for (size_t j = i + 1; j < eyes.size(); ++j) {
      const auto point = TriangulatePoint(*eyes[i].cam_from_world, eyes[i].ray,
                                          *eyes[j].cam_from_world, eyes[j].ray);
      if (!point || !point->allFinite()) continue;
      const double parallax = ParallaxAngle(eyes[i].centre, eyes[j].centre, *point);
      if (parallax < min_parallax) continue;
      const auto agreeing = static_cast<int>(std::ranges::count_if(eyes, [&](const Eye& eye) {
        return SquaredErrorPx(state.lens.camera, *eye.cam_from_world * *point, eye.px) <
               eye.max_squared;
      }));
      if (agreeing < most + (best ? 0 : 1) || (agreeing == most && parallax <= widest)) continue;
      best = point, most = agreeing, widest = parallax;
    }
  }
  return best;
}

/// A point with fewer than two sights that agree, or too little parallax between these, is none.
/// Gives how many sights changed sides.
int TrackPoints::JudgeTrack(size_t track, SurveyState* state) const {
  const std::vector<Track::Sight>& sights = tracks_->tracks[track].sights;
  std::vector<Eigen::Vector3d> centres;
  int changed = 0;
  for (size_t s = 0; s < sights.size(); ++s) {
    const auto& pose = state->cam_from_world[static_cast<size_t>(sights[s].view)];
    const bool agreed = state->agrees[track][s];
    state->agrees[track][s] = pose && Agrees(*state->points[track], sights[s], *state);
    changed += agreed != (state->agrees[track][s] != 0);
    if (state->agrees[track][s]) centres.push_back(pose->InverseTranslation());
  }
  constexpr double kStaysWith = 0.5;  // what the adjustment took of the parallax it was made with
  const double min_parallax = kStaysWith * options_.min_parallax_deg * std::numbers::pi / 180;
  for (size_t i = 0; i < centres.size(); ++i) {
    for (size_t j = i + 1; j < centres.size(); ++j) {
      if (ParallaxAngle(centres[i], centres[j], *state->points[track]) >= min_parallax)
        return changed;
    }
  }
  state->points[track].reset();
  std::fill(state->agrees[track].begin(), state->agrees[track].end(), uint8_t{0});
  return std::max(changed, 1);
}

int TrackPoints::Judge(SurveyState* state) const {
  return ForAllTracks(
      [this, state](size_t t) { return state->points[t] ? JudgeTrack(t, state) : 0; });
}

}  // namespace deepuav
