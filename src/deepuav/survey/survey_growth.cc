#include "deepuav/survey/survey_growth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "deepuav/base/parallel.h"
#include "deepuav/estimation/poses/absolute_pose.h"
#include "deepuav/estimation/two_views/two_view.h"
#include "deepuav/geometry/triangulation.h"

namespace deepuav {
namespace {

/// While the lens is hardly known, errors are this much larger...
constexpr double kYoungLens = 3;
/// ...until so many photographs tell it.
constexpr int kYoungLensViews = 5;
/// From so many on the lens is refined: fewer leave it to the prior.
constexpr int kRefineViews = 3;
/// Iterations in between and at the end.
constexpr int kGrowIterations = 12, kFinishIterations = 40;
/// Squares of the standard deviations by which poses and lens may still move.
constexpr double kRoughly = 1, kStill = 0.01;
/// A map is adjusted as nearly right from so many photographs on.
constexpr int kSmallMap = 10;
/// Sights of a track from which it is triangulated, at most: further ones add little.
constexpr size_t kTriangulationSights = 7;

}  // namespace

SurveyGrowth::SurveyGrowth(const Tracks* tracks, const ViewPixels* px, const SurveyLens& lens,
                           const SurveyOptions& options)
    : tracks_(tracks),
      px_(px),
      options_(options),
      state_(*tracks, px->size(), lens),
      failed_at_(px->size(), 0) {}

const SightPixel& SurveyGrowth::SightOf(const Track::Sight& sight) const {
  return (*px_)[static_cast<size_t>(sight.view)][static_cast<size_t>(sight.keypoint)];
}

const Eigen::Vector2d& SurveyGrowth::PixelOf(const Track::Sight& sight) const {
  return SightOf(sight).px;
}

bool SurveyGrowth::lens_is_young() const {
  return state_.lens.is_refined && state_.ViewCount() < kYoungLensViews;
}

double SurveyGrowth::MaxErrorPx() const {
  return (lens_is_young() ? kYoungLens : 1) * options_.max_error_px;
}

/// What was detected at a part of the size errs by as much more.
double SurveyGrowth::MaxSquaredErrorPx(const SightPixel& sight) const {
  const double max_px = MaxErrorPx() * (sight.by_patch ? 1 : sight.noise.SigmaPx());
  return max_px * max_px;
}

/// In the photograph, which has a pose, and where a patch measured it as far as that may err.
bool SurveyGrowth::Agrees(const Eigen::Vector3d& point, const Track::Sight& sight) const {
  const SightPixel& seen = SightOf(sight);
  const Eigen::Vector3d point_cam = state_.InCamera(point, sight.view, seen.px.y());
  if (!InFrontOfCamera(point_cam)) return false;
  const Eigen::Vector2d error_px = state_.lens.camera.Project(point_cam) - seen.px;
  if (!(error_px.squaredNorm() < MaxSquaredErrorPx(seen))) return false;
  if (!seen.by_patch || state_.model_sigma_px == 0) return true;
  const Whitening whitening(seen.NoiseWith(state_.model_sigma_px));
  return (whitening * error_px).norm() < options_.max_patch_sigmas;
}

std::vector<SE3> SurveyGrowth::PosesOf(const MatchedPair& pair) const {
  std::vector<PixelPair> pixels;
  for (const Match& match : pair.matches) {
    const auto a = state_.lens.Undistort(PixelOf({pair.a, match.a}));
    const auto b = state_.lens.Undistort(PixelOf({pair.b, match.b}));
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
  TriangulateIn(pair.b);
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
  TriangulateAll();
}

void SurveyGrowth::Continue(const SurveyState& known) {
  state_ = known;
  Judge();
  TriangulateAll();
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
  const double sigma_px = lens_is_young() ? kYoungLens : 1;
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
  robust.max_error_px = 1.5 * MaxErrorPx();
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
  TriangulateIn(view);
  return true;
}

void SurveyGrowth::TriangulateIn(int view) {
  for (const int track : tracks_->of_keypoint[static_cast<size_t>(view)]) {
    if (track < 0) continue;
    const auto t = static_cast<size_t>(track);
    if (state_.points[t]) {
      JudgeTrack(t);
    } else {
      Triangulate(t);
    }
  }
}

/// The sum of what is counted, over all tracks at once: none changes what is known of another.
int SurveyGrowth::ForAllTracks(const std::function<int(size_t)>& count) const {
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

/// Gives how many points were found.
int SurveyGrowth::TriangulateAll() {
  return ForAllTracks([this](size_t t) { return !state_.points[t] && Triangulate(t) ? 1 : 0; });
}

/// Of the points that two sights give the one with which most sights agree.
bool SurveyGrowth::Triangulate(size_t track) {
  struct Eye {
    const SE3* cam_from_world;
    Eigen::Vector3d ray;
    Eigen::Vector3d centre;
    Eigen::Vector2d px;
    double max_squared;
  };
  std::vector<Eye> eyes;
  for (const Track::Sight& sight : tracks_->tracks[track].sights) {
    const auto& pose = state_.cam_from_world[static_cast<size_t>(sight.view)];
    if (!pose || eyes.size() == kTriangulationSights) continue;
    if (const auto ray = state_.lens.Ray(PixelOf(sight)))
      eyes.push_back({&*pose, *ray, pose->InverseTranslation(), PixelOf(sight),
                      MaxSquaredErrorPx(SightOf(sight))});
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
      int agreeing = 0;
      for (const Eye& eye : eyes) {
        agreeing += SquaredErrorPx(state_.lens.camera, *eye.cam_from_world * *point, eye.px) <
                    eye.max_squared;
      }
      if (agreeing < most + (best ? 0 : 1) || (agreeing == most && parallax <= widest)) continue;
      best = point, most = agreeing, widest = parallax;
    }
  }
  state_.points[track] = best;
  if (best) JudgeTrack(track);
  return state_.points[track].has_value();
}

/// A point with fewer than two sights that agree, or too little parallax between these, is none.
/// Gives how many sights changed sides.
int SurveyGrowth::JudgeTrack(size_t track) {
  const std::vector<Track::Sight>& sights = tracks_->tracks[track].sights;
  std::vector<Eigen::Vector3d> centres;
  int changed = 0;
  for (size_t s = 0; s < sights.size(); ++s) {
    const auto& pose = state_.cam_from_world[static_cast<size_t>(sights[s].view)];
    const bool agreed = state_.agrees[track][s];
    state_.agrees[track][s] = pose && Agrees(*state_.points[track], sights[s]);
    changed += agreed != (state_.agrees[track][s] != 0);
    if (state_.agrees[track][s]) centres.push_back(pose->InverseTranslation());
  }
  constexpr double kStaysWith = 0.5;  // what the adjustment took of the parallax it was made with
  const double min_parallax = kStaysWith * options_.min_parallax_deg * std::numbers::pi / 180;
  for (size_t i = 0; i < centres.size(); ++i) {
    for (size_t j = i + 1; j < centres.size(); ++j) {
      if (ParallaxAngle(centres[i], centres[j], *state_.points[track]) >= min_parallax)
        return changed;
    }
  }
  state_.points[track].reset();
  std::fill(state_.agrees[track].begin(), state_.agrees[track].end(), uint8_t{0});
  return std::max(changed, 1);
}

int SurveyGrowth::Judge() {
  return ForAllTracks([this](size_t t) { return state_.points[t] ? JudgeTrack(t) : 0; });
}

/// Gives how many sights changed sides.
int SurveyGrowth::AdjustAll(int max_iterations, double max_last_move,
                            const std::function<bool()>& stop) {
  AdjustmentEffort effort{.max_iterations = max_iterations, .max_last_move = max_last_move};
  adjusted_views_ = state_.ViewCount();
  effort.refine_lens = adjusted_views_ >= kRefineViews;
  effort.is_nearly_right = adjusted_views_ > kSmallMap;
  AdjustAllViews(*tracks_, *px_, effort, options_, stop, &state_);
  return Judge();
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
  for (const int seen : window) TriangulateIn(seen);
}

void SurveyGrowth::Settle(const std::function<bool()>& stop) {
  constexpr double kSettled = 1e-3;  // of the key points' sights
  int sights = 0;
  for (const Track& track : tracks_->tracks) sights += static_cast<int>(track.sights.size());
  for (int round = 0; round < options_.finish_rounds && !(stop && stop()); ++round) {
    const int changed = AdjustAll(kFinishIterations, kRoughly, stop) + TriangulateAll();
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
                                                  PixelOf(sights[s])) /
                                       max_squared);
    }
  }
  return support;
}

}  // namespace deepuav
