#include "deepuav/survey/survey_adjustment.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// A bundle problem and what its indices mean.
struct SurveyBundle {
  BundleProblem problem;
  std::vector<int> views, tracks;
};

SurveyBundle MakeBundle(const Tracks& tracks, const ViewPixels& px, const std::vector<int>& free,
                        const SurveyState& state) {
  SurveyBundle bundle;
  BundleProblem& problem = bundle.problem;
  problem.pinhole = state.lens.camera.pinhole;
  problem.k1 = state.lens.camera.k1;
  problem.k2 = state.lens.camera.k2;
  problem.focal_guess_px = state.lens.focal_guess_px;
  std::vector<uint8_t> is_free(state.cam_from_world.size(), 0);
  for (const int view : free) is_free[static_cast<size_t>(view)] = 1;
  std::vector<int> camera_of_view(state.cam_from_world.size(), -1);
  const auto camera_of = [&](int view) {
    int& camera = camera_of_view[static_cast<size_t>(view)];
    if (camera >= 0) return camera;
    camera = static_cast<int>(bundle.views.size());
    bundle.views.push_back(view);
    problem.cam_from_world.push_back(*state.cam_from_world[static_cast<size_t>(view)]);
    problem.camera_fixed.push_back(!is_free[static_cast<size_t>(view)]);
    return camera;
  };
  for (size_t t = 0; t < tracks.tracks.size(); ++t) {
    if (!state.points[t]) continue;
    const std::vector<Track::Sight>& sights = tracks.tracks[t].sights;
    const auto counts = [&](size_t s) {
      return state.agrees[t][s] && state.cam_from_world[static_cast<size_t>(sights[s].view)];
    };
    bool is_seen = false;
    for (size_t s = 0; s < sights.size(); ++s)
      is_seen |= counts(s) && is_free[static_cast<size_t>(sights[s].view)];
    if (!is_seen) continue;
    const int landmark = static_cast<int>(bundle.tracks.size());
    bundle.tracks.push_back(static_cast<int>(t));
    problem.landmarks_world.push_back(*state.points[t]);
    for (size_t s = 0; s < sights.size(); ++s) {
      if (!counts(s)) continue;
      const auto& [view, keypoint] = sights[s];
      problem.observations.push_back({camera_of(view), landmark,
                                      px[static_cast<size_t>(view)][static_cast<size_t>(keypoint)],
                                      1.0});
    }
  }
  return bundle;
}

/// Distance of the image's corner from its centre over the focal length, below which nothing tells
/// k2 from k1 and the focal length.
constexpr double kMinK2Radius = 0.7;

BundleOptions OptionsOf(bool refine_lens, int max_iterations, const SurveyOptions& options,
                        const SurveyLens& lens) {
  BundleOptions bundle;
  bundle.max_iterations = max_iterations;
  // Nearly level flight tells the focal length by little: the cost is flat along it.
  constexpr double kFlat = 1e-7;
  if (refine_lens) bundle.min_relative_decrease = kFlat;
  bundle.refine_focal = bundle.refine_radial = refine_lens && lens.is_refined;
  if (lens.is_refined) bundle.focal_sigma = lens.focal_sigma;
  bundle.k1_sigma = options.k1_sigma;
  const Pinhole& pinhole = lens.camera.pinhole;
  const double corner_radius = std::hypot(pinhole.cx, pinhole.cy) / pinhole.fx;
  constexpr double kAsGoodAsNone = 1e-4;
  bundle.k2_sigma = corner_radius < kMinK2Radius ? kAsGoodAsNone : options.k2_sigma;
  return bundle;
}

std::vector<int> AllViews(const SurveyState& state) {
  std::vector<int> views;
  for (size_t i = 0; i < state.cam_from_world.size(); ++i) {
    if (state.cam_from_world[i]) views.push_back(static_cast<int>(i));
  }
  return views;
}

}  // namespace

void AdjustViews(const Tracks& tracks, const ViewPixels& px, const std::vector<int>& free,
                 bool refine_lens, int max_iterations, const SurveyOptions& options,
                 const std::function<bool()>& stop, SurveyState* state) {
  SurveyBundle bundle = MakeBundle(tracks, px, free, *state);
  BundleProblem& problem = bundle.problem;
  if (problem.observations.empty()) return;
  const bool none_fixed = std::none_of(problem.camera_fixed.begin(), problem.camera_fixed.end(),
                                       [](uint8_t fixed) { return fixed != 0; });
  if (none_fixed) problem.camera_fixed.front() = 1;
  const SurveyLens before = state->lens;
  AdjustBundle(&problem, OptionsOf(refine_lens, max_iterations, options, before), stop);
  state->lens.camera = {problem.pinhole, problem.k1, problem.k2};
  for (size_t i = 0; i < bundle.views.size(); ++i)
    state->cam_from_world[static_cast<size_t>(bundle.views[i])] = problem.cam_from_world[i];
  for (size_t i = 0; i < bundle.tracks.size(); ++i)
    state->points[static_cast<size_t>(bundle.tracks[i])] = problem.landmarks_world[i];
}

void AdjustAllViews(const Tracks& tracks, const ViewPixels& px, bool refine_lens,
                    int max_iterations, const SurveyOptions& options,
                    const std::function<bool()>& stop, SurveyState* state) {
  AdjustViews(tracks, px, AllViews(*state), refine_lens, max_iterations, options, stop, state);
}

std::optional<CalibrationSigmas> LensSigmas(const Tracks& tracks, const ViewPixels& px,
                                            const SurveyOptions& options,
                                            const SurveyState& state) {
  if (!state.lens.is_refined) return std::nullopt;
  SurveyBundle bundle = MakeBundle(tracks, px, AllViews(state), state);
  if (bundle.problem.observations.empty()) return std::nullopt;
  bundle.problem.camera_fixed.front() = 1;
  return EstimateCalibrationSigmas(bundle.problem, OptionsOf(true, 0, options, state.lens));
}

}  // namespace deepuav
