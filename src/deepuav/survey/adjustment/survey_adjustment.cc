#include "deepuav/survey/adjustment/survey_adjustment.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

/// A bundle problem and what its indices mean.
struct SurveyBundle {
  BundleProblem problem;
  std::vector<int> views, tracks;
};

/// 1 for each track that one of the views has a key point of: for a window of a large map the
/// others need not be looked at.
std::vector<uint8_t> TracksOf(const std::vector<int>& views, const Tracks& tracks) {
  std::vector<uint8_t> is_of(tracks.tracks.size(), 0);
  for (const int view : views) {
    for (const int track : tracks.of_keypoint[static_cast<size_t>(view)]) {
      if (track >= 0) is_of[static_cast<size_t>(track)] = 1;
    }
  }
  return is_of;
}

SurveyBundle MakeBundle(const Tracks& tracks, const ViewPixels& px, const std::vector<int>& free,
                        const SurveyState& state) {
  SurveyBundle bundle;
  BundleProblem& problem = bundle.problem;
  problem.pinhole = state.lens.camera.pinhole;
  problem.k1 = state.lens.camera.k1;
  problem.k2 = state.lens.camera.k2;
  problem.p1 = state.lens.camera.p1;
  problem.p2 = state.lens.camera.p2;
  problem.readout_s = state.lens.camera.readout_s;
  problem.focal_guess_px = state.lens.focal_guess_px;
  problem.centre_guess_px = state.lens.centre_guess_px;
  problem.radial_guess = state.lens.radial_guess;
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
  const std::vector<uint8_t> is_near = TracksOf(free, tracks);
  for (size_t t = 0; t < tracks.tracks.size(); ++t) {
    if (!is_near[t] || !state.points[t]) continue;
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
      const SightPixel& pixel = px[static_cast<size_t>(view)][static_cast<size_t>(keypoint)];
      problem.observations.push_back({camera_of(view), landmark, pixel.px,
                                      pixel.NoiseWith(state.model_sigma_px),
                                      state.DriftPerS(view, pixel.px.y())});
    }
  }
  return bundle;
}

/// Distance of the image's corner from its centre over the focal length, below which nothing tells
/// k2 from k1 and the focal length.
constexpr double kMinK2Radius = 0.7;

BundleOptions OptionsOf(const AdjustmentEffort& effort, const SurveyOptions& options,
                        const SurveyLens& lens) {
  constexpr double kNearlyRightDamping = 1e-8;
  BundleOptions bundle;
  bundle.max_iterations = effort.max_iterations;
  bundle.max_last_move = effort.max_last_move;
  bundle.threads = ThreadsOf(options);
  // Nearly level flight tells the focal length by little: the cost is flat along it, and damping
  // would let it creep.
  if (effort.is_nearly_right) bundle.initial_damping = kNearlyRightDamping;
  bundle.refine_radial = effort.refine_lens && lens.is_refined;
  bundle.refine_focal = bundle.refine_radial && !lens.holds_focal;
  if (lens.is_refined) bundle.focal_sigma = lens.focal_sigma;
  bundle.k1_sigma = options.k1_sigma;
  const Pinhole& pinhole = lens.camera.pinhole;
  const double corner_radius = std::hypot(pinhole.cx, pinhole.cy) / pinhole.fx;
  constexpr double kAsGoodAsNone = 1e-4;
  const bool tells_k2 = lens.is_refined_wholly || corner_radius >= kMinK2Radius;
  bundle.k2_sigma = tells_k2 ? options.k2_sigma : kAsGoodAsNone;
  bundle.refine_centre = bundle.refine_tangential = bundle.refine_readout =
      bundle.refine_radial && lens.is_refined_wholly;
  bundle.centre_sigma = options.centre_sigma;
  bundle.tangential_sigma = options.tangential_sigma;
  bundle.readout_sigma_s = options.readout_sigma_s;
  return bundle;
}

std::vector<int> AllViews(const SurveyState& state) {
  std::vector<int> views;
  for (size_t i = 0; i < state.cam_from_world.size(); ++i) {
    if (state.cam_from_world[i]) views.push_back(static_cast<int>(i));
  }
  return views;
}

/// Velocities are in units of the map, which could else grow as the readout falls: the view
/// farthest from the one that holds the gauge stays about as far.
void HoldScale(SurveyBundle* bundle) {
  BundleProblem& problem = bundle->problem;
  const Eigen::Vector3d held = problem.cam_from_world.front().InverseTranslation();
  PositionFactor farthest;
  double distance = 0;
  for (size_t i = 1; i < problem.cam_from_world.size(); ++i) {
    const Eigen::Vector3d centre = problem.cam_from_world[i].InverseTranslation();
    if ((centre - held).norm() <= distance) continue;
    distance = (centre - held).norm();
    farthest.camera = static_cast<int>(i);
    farthest.position_world = centre;
  }
  if (distance == 0) return;
  constexpr double kScaleSigma = 0.01;  // loose beside what the photographs tell of the shape
  farthest.per_sigma.setConstant(1 / (kScaleSigma * distance));
  problem.factors.positions.push_back(farthest);
}

}  // namespace

void AdjustViews(const Tracks& tracks, const ViewPixels& px, const std::vector<int>& free,
                 const AdjustmentEffort& effort, const SurveyOptions& options,
                 const std::function<bool()>& stop, SurveyState* state) {
  SurveyBundle bundle = MakeBundle(tracks, px, free, *state);
  BundleProblem& problem = bundle.problem;
  if (problem.observations.empty()) return;
  const bool none_fixed = std::none_of(problem.camera_fixed.begin(), problem.camera_fixed.end(),
                                       [](uint8_t fixed) { return fixed != 0; });
  if (none_fixed) problem.camera_fixed.front() = 1;
  const SurveyLens before = state->lens;
  if (none_fixed && before.is_refined_wholly) HoldScale(&bundle);
  const BundleOptions bundle_options = OptionsOf(effort, options, before);
  AdjustBundle(&problem, bundle_options, stop);
  const bool is_measured = state->model_sigma_px > 0;
  if (is_measured && none_fixed && options.tails.rounds > 0)
    AdjustByTails(&problem, bundle_options, options.tails, stop);
  state->lens.camera = {problem.pinhole, problem.k1, problem.k2,
                        problem.p1,      problem.p2, problem.readout_s};
  for (size_t i = 0; i < bundle.views.size(); ++i)
    state->cam_from_world[static_cast<size_t>(bundle.views[i])] = problem.cam_from_world[i];
  for (size_t i = 0; i < bundle.tracks.size(); ++i)
    state->points[static_cast<size_t>(bundle.tracks[i])] = problem.landmarks_world[i];
}

void AdjustAllViews(const Tracks& tracks, const ViewPixels& px, const AdjustmentEffort& effort,
                    const SurveyOptions& options, const std::function<bool()>& stop,
                    SurveyState* state) {
  AdjustViews(tracks, px, AllViews(*state), effort, options, stop, state);
}

std::optional<RefinedLens> DescribeLens(const Tracks& tracks, const ViewPixels& px,
                                        const SurveyOptions& options, const SurveyState& state) {
  if (!state.lens.is_refined) return std::nullopt;
  SurveyBundle bundle = MakeBundle(tracks, px, AllViews(state), state);
  if (bundle.problem.observations.empty()) return std::nullopt;
  bundle.problem.camera_fixed.front() = 1;
  if (state.lens.is_refined_wholly) HoldScale(&bundle);
  auto sigmas = EstimateCalibrationSigmas(
      bundle.problem, OptionsOf({.refine_lens = true, .max_last_move = 1}, options, state.lens));
  if (state.lens.holds_focal) {
    if (!sigmas) sigmas.emplace();
    sigmas->focal = state.lens.focal_sigma;
  }
  if (!sigmas) return std::nullopt;
  return RefinedLens{*sigmas, state.lens.camera.readout_s, !state.lens.holds_focal};
}

}  // namespace deepuav
