#include "deepuav/survey/growth/survey_growth.h"

#include <algorithm>
#include <map>

#include "deepuav/estimation/poses/absolute_pose.h"
#include "deepuav/estimation/two_views/two_view.h"

namespace deepuav {
namespace {

/// From so many on the lens is refined: fewer leave it to the prior.
constexpr int kRefineViews = 3;
/// Iterations in between and at the end.
constexpr int kGrowIterations = 12;
/// A strip of photographs bends, and its lens with it, in hundreds of small steps; others stand
/// still long before.
constexpr int kFinishIterations = 500;
/// Squares of the standard deviations by which poses and lens may still move.
constexpr double kRoughly = 1, kStill = 0.01;
/// A map is adjusted as nearly right from so many photographs on.
constexpr int kSmallMap = 10;
}  // namespace

SurveyGrowth::SurveyGrowth(const Tracks* tracks, const ViewPixels* px, const SurveyLens& lens,
                           const SurveyOptions& options)
    : tracks_(tracks),
      px_(px),
      options_(options),
      points_(tracks, px, options),
      state_(*tracks, px->size(), lens),
      failed_at_(px->size(), 0) {}

std::vector<SE3> SurveyGrowth::PosesOf(const MatchedPair& pair) const {
  std::vector<PixelPair> pixels;
  for (const Match& match : pair.matches) {
    const auto a = state_.lens.Undistort(points_.PixelOf({pair.a, match.a}));
    const auto b = state_.lens.Undistort(points_.PixelOf({pair.b, match.b}));
    if (a && b) pixels.push_back({*a, *b});
  }
  TwoViewOptions options;
  options.max_error_px = state_.lens.is_refined ? options_.pair_error_px : options_.max_error_px;
  options.min_inliers = options_.min_pair_matches;
  options.min_parallax_deg = 2 * options_.min_parallax_deg;
  constexpr double kMinFrontRatio = 0.7;  // a wrong lens puts points behind
  options.min_front_ratio = kMinFrontRatio;
  std::vector<SE3> poses;
  const auto seed = static_cast<uint64_t>(pair.a) << 32 | static_cast<uint64_t>(pair.b);
  if (const auto result = EstimateTwoView(state_.lens.camera.pinhole, pixels, seed, options)) {
    for (const TwoViewSolution& solution : result->solutions) poses.push_back(solution.b_from_a);
  }
  return poses;
}

bool SurveyGrowth::Start(const MatchedPair& pair, const SE3& b_from_a) {
  state_.cam_from_world[static_cast<size_t>(pair.a)] = SE3();
  state_.cam_from_world[static_cast<size_t>(pair.b)] = b_from_a;
  points_.TriangulateIn(pair.b, &state_);
  AdjustAll(kGrowIterations, kRoughly, nullptr);
  const auto points = std::count_if(state_.points.begin(), state_.points.end(),
                                    [](const auto& point) { return point.has_value(); });
  return points >= options_.min_pair_matches;
}

void SurveyGrowth::Resume(const SurveyState& known) {
  state_.lens = known.lens;
  state_.model_sigma_px = known.model_sigma_px;
  state_.velocity_world = known.velocity_world;
  state_.image_rows = known.image_rows;
  state_.cam_from_world = known.cam_from_world;
  points_.TriangulateAll(&state_);
}

void SurveyGrowth::Continue(const SurveyState& known) {
  state_ = known;
  points_.Judge(&state_);
  points_.TriangulateAll(&state_);
}

SurveyGrowth::NextView SurveyGrowth::ChooseNext(const std::set<int>& taken) const {
  NextView best;
  for (size_t v = 0; v < px_->size(); ++v) {
    const int view = static_cast<int>(v);
    if (state_.cam_from_world[v] || taken.contains(view)) continue;
    int points = 0;
    for (const int track : tracks_->of_keypoint[v])
      points += track >= 0 && state_.points[static_cast<size_t>(track)];
    constexpr double kWorthAnotherTry = 1.2;
    if (points < options_.min_pose_inliers || points < kWorthAnotherTry * failed_at_[v]) continue;
    if (points > best.points) best = {view, points};
  }
  return best;
}

void SurveyGrowth::Grow(int most_views, const std::set<int>& taken,
                        const std::function<bool()>& stop) {
  for (int views = state_.ViewCount(); views < most_views; views = state_.ViewCount()) {
    if (stop && stop()) return;
    const NextView next = ChooseNext(taken);
    if (next.view < 0) return;
    if (!AddView(next.view)) {
      failed_at_[static_cast<size_t>(next.view)] = next.points;
      continue;
    }
    const bool grown = state_.ViewCount() >= options_.adjust_growth * adjusted_views_;
    if (grown || state_.ViewCount() <= kSmallMap) {
      AdjustAll(kGrowIterations, kRoughly, stop);
    } else {
      AdjustAround(next.view, stop);
    }
    if (watch_) watch_(state_);
  }
}

bool SurveyGrowth::AddView(int view) {
  const auto v = static_cast<size_t>(view);
  std::vector<PoseObservation> observations;
  const double sigma_px = LensDoubt(state_);
  for (size_t k = 0; k < tracks_->of_keypoint[v].size(); ++k) {
    const int track = tracks_->of_keypoint[v][k];
    if (track < 0 || !state_.points[static_cast<size_t>(track)]) continue;
    const SightPixel& sight = (*px_)[v][k];
    const auto px = state_.lens.Undistort(sight.px);
    if (!px) continue;
    observations.push_back({*state_.points[static_cast<size_t>(track)], *px,
                            sigma_px * (sight.by_patch ? 1 : sight.noise.SigmaPx())});
  }
  AbsolutePoseOptions robust;
  robust.max_error_px = 1.5 * points_.MaxErrorPx(state_);
  constexpr int kIterations = 2000;
  robust.max_iterations = kIterations;
  robust.min_inliers = options_.min_pose_inliers;
  const auto pose = EstimateAbsolutePose(state_.lens.camera.pinhole, observations,
                                         static_cast<uint64_t>(view), robust);
  if (!pose) return false;
  const MotionOnlyResult refined = OptimisePose(state_.lens.camera.pinhole, observations,
                                                pose->cam_from_world, MotionOnlyOptions{});
  const auto matched = static_cast<double>(observations.size());
  if (refined.inlier_count < options_.min_pose_inliers ||
      refined.inlier_count < options_.min_pose_ratio * matched)
    return false;
  state_.cam_from_world[v] = refined.cam_from_world;
  points_.TriangulateIn(view, &state_);
  return true;
}

/// Gives how many sights changed sides.
int SurveyGrowth::AdjustAll(int max_iterations, double max_last_move,
                            const std::function<bool()>& stop) {
  AdjustmentEffort effort{.max_iterations = max_iterations, .max_last_move = max_last_move};
  adjusted_views_ = state_.ViewCount();
  effort.refine_lens = adjusted_views_ >= kRefineViews;
  effort.is_nearly_right = adjusted_views_ > kSmallMap;
  AdjustAllViews(*tracks_, *px_, effort, options_, stop, &state_);
  return points_.Judge(&state_);
}

void SurveyGrowth::AdjustAround(int view, const std::function<bool()>& stop) {
  std::map<int, int> shared;
  for (const int track : tracks_->of_keypoint[static_cast<size_t>(view)]) {
    if (track < 0 || !state_.points[static_cast<size_t>(track)]) continue;
    for (const Track::Sight& sight : tracks_->tracks[static_cast<size_t>(track)].sights) {
      if (sight.view != view && state_.cam_from_world[static_cast<size_t>(sight.view)])
        ++shared[sight.view];
    }
  }
  std::vector<std::pair<int, int>> by_shared;  // negative number shared, view
  for (const auto& [other, count] : shared) by_shared.emplace_back(-count, other);
  std::sort(by_shared.begin(), by_shared.end());
  std::vector<int> window = {view};
  for (const auto& [count, other] : by_shared) {
    if (static_cast<int>(window.size()) == options_.window_views) break;
    window.push_back(other);
  }
  constexpr double kAnyMove = 1e8;
  AdjustViews(*tracks_, *px_, window,
              {.max_iterations = kGrowIterations, .max_last_move = kAnyMove}, options_, stop,
              &state_);
  for (const int seen : window) points_.TriangulateIn(seen, &state_);
}

void SurveyGrowth::Settle(const std::function<bool()>& stop) {
  constexpr double kSettled = 1e-3;  // of the key points' sights
  int sights = 0;
  for (const Track& track : tracks_->tracks) sights += static_cast<int>(track.sights.size());
  for (int round = 0; round < options_.finish_rounds && !(stop && stop()); ++round) {
    int changed = AdjustAll(kFinishIterations, kRoughly, stop);
    changed += points_.TriangulateAll(&state_);
    if (changed <= kSettled * sights) return;
  }
}

void SurveyGrowth::Finish(const std::function<bool()>& stop) {
  if (!(stop && stop())) AdjustAll(kFinishIterations, kStill, stop);
}

double SurveyGrowth::Support() const {
  const double max_squared = options_.max_error_px * options_.max_error_px;
  double support = 0;
  for (size_t t = 0; t < tracks_->tracks.size(); ++t) {
    if (!state_.points[t]) continue;
    const std::vector<Track::Sight>& sights = tracks_->tracks[t].sights;
    for (size_t s = 0; s < sights.size(); ++s) {
      const auto& pose = state_.cam_from_world[static_cast<size_t>(sights[s].view)];
      if (!pose || !state_.agrees[t][s]) continue;
      support += std::max(0.0, 1 - SquaredErrorPx(state_.lens.camera, *pose * *state_.points[t],
                                                  points_.PixelOf(sights[s])) /
                                       max_squared);
    }
  }
  return support;
}

}  // namespace deepuav
