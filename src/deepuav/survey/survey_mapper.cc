#include "deepuav/survey/survey_mapper.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "deepuav/base/logging.h"
#include "deepuav/survey/survey_map.h"
#include "deepuav/survey/survey_start.h"

namespace deepuav {
namespace {

/// The distortion of a lens that k1 and k2 describe alone; nothing for others.
std::optional<std::pair<double, double>> PlainRadial(const Camera& camera) {
  if (camera.lens == LensModel::kPinhole) return std::pair(0.0, 0.0);
  if (camera.lens != LensModel::kRadialTangential) return std::nullopt;
  const std::vector<double>& d = camera.distortion;
  const bool is_plain = d[2] == 0 && d[3] == 0 && (d.size() < 5 || d[4] == 0);
  return is_plain ? std::optional(std::pair(d[0], d[1])) : std::nullopt;
}

std::set<int> ViewsIn(const SurveyState& state) {
  std::set<int> views;
  for (size_t v = 0; v < state.cam_from_world.size(); ++v) {
    if (state.cam_from_world[v]) views.insert(static_cast<int>(v));
  }
  return views;
}

/// By how many quarter turns clockwise the image of a looks like that of b.
int QuarterTurns(const SE3& b_from_a) {
  const Eigen::Vector3d right_of_a = b_from_a.rotation() * Eigen::Vector3d::UnitX();
  const double angle = std::atan2(right_of_a.y(), right_of_a.x());
  const auto turns = static_cast<int>(std::lround(angle / (std::numbers::pi / 2)));
  return (turns % 4 + 4) % 4;
}

}  // namespace

SurveyMapper::SurveyMapper(const Camera& camera, double focal_sigma, const SurveyOptions& options,
                           const SurveyEyes& eyes, StageListener* stages,
                           const SurveyMeasuring& measuring)
    : camera_(camera), options_(options), eyes_(eyes), stages_(stages), measuring_(measuring) {
  options_.Check();
  const auto radial = PlainRadial(camera);
  lens_.camera.pinhole = camera.pinhole;
  lens_.focal_guess_px = camera.pinhole.fx;
  lens_.centre_guess_px = {camera.pinhole.cx, camera.pinhole.cy};
  lens_.is_refined = keeps_distortion_ = focal_sigma > 0 && radial;
  if (!lens_.is_refined) return;
  lens_.focal_sigma = focal_sigma;
  std::tie(lens_.camera.k1, lens_.camera.k2) = *radial;
}

ViewPixels SurveyMapper::PixelsOf(const std::vector<SurveyView>& views) const {
  ViewPixels px;
  for (const SurveyView& view : views) {
    std::vector<SightPixel>& of_view = px.emplace_back();
    for (const Keypoint& keypoint : view.frame.features->keypoints) {
      of_view.push_back({(keeps_distortion_ ? keypoint.image_px : keypoint.px).cast<double>()});
    }
  }
  return px;
}

std::vector<PairCandidate> SurveyMapper::OverlappingPairs(const Tracks& tracks,
                                                          const SurveyState& state) const {
  constexpr size_t kProbes = 60;  // points of a view that stand for what it sees
  std::vector<PairCandidate> pairs;
  const std::set<int> views = ViewsIn(state);
  for (const int a : views) {
    std::vector<Eigen::Vector3d> seen;
    for (const int track : tracks.of_keypoint[static_cast<size_t>(a)]) {
      if (track >= 0 && state.points[static_cast<size_t>(track)])
        seen.push_back(*state.points[static_cast<size_t>(track)]);
    }
    const size_t step = std::max<size_t>(1, seen.size() / kProbes);
    std::vector<std::pair<double, int>> overlaps;  // negative share, view
    for (const int b : views) {
      if (b == a) continue;
      const SE3& b_from_world = *state.cam_from_world[static_cast<size_t>(b)];
      int inside = 0, probes = 0;
      for (size_t i = 0; i < seen.size(); i += step) {
        const Eigen::Vector3d point = b_from_world * seen[i];
        ++probes;
        if (point.z() <= 0) continue;
        const Eigen::Vector2d px = state.lens.camera.Project(point);
        inside += px.x() >= 0 && px.y() >= 0 && px.x() < camera_.width && px.y() < camera_.height;
      }
      const double share = probes > 0 ? static_cast<double>(inside) / probes : 0;
      if (share >= options_.min_overlap) overlaps.emplace_back(-share, b);
    }
    std::sort(overlaps.begin(), overlaps.end());
    for (size_t i = 0; i < overlaps.size() && i < static_cast<size_t>(options_.overlap_neighbours);
         ++i) {
      const int b = overlaps[i].second;
      const int first = std::min(a, b), second = std::max(a, b);
      const SE3 second_from_first = *state.cam_from_world[static_cast<size_t>(second)] *
                                    state.cam_from_world[static_cast<size_t>(first)]->Inverse();
      pairs.push_back({first, second, QuarterTurns(second_from_first)});
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

void SurveyMapper::MatchOverlaps(const std::vector<SurveyView>& views, const BuiltSurvey& built,
                                 std::vector<MatchedPair>* pairs,
                                 const std::function<bool()>& stop) {
  std::set<std::pair<int, int>> matched;
  for (const MatchedPair& pair : *pairs) matched.emplace(pair.a, pair.b);
  std::vector<PairCandidate> candidates;
  for (const PairCandidate& pair : OverlappingPairs(built.tracks, built.state)) {
    if (!matched.contains({pair.a, pair.b}) && tried_.insert(pair).second)
      candidates.push_back(pair);
  }
  PairMatching matching(&views, eyes_.quick, eyes_.learned, options_);
  std::vector<MatchedPair> more = matching.Match(candidates, stop);
  Log().debug("{} of {} more pairs that overlap were matched", more.size(), candidates.size());
  for (MatchedPair& pair : more) pairs->push_back(std::move(pair));
}

std::optional<BuiltSurvey> SurveyMapper::Build(const std::vector<SurveyView>& views,
                                               const ViewPixels& px, const std::set<int>& taken,
                                               std::vector<MatchedPair>* pairs,
                                               const std::function<bool()>& stop) {
  const int most = static_cast<int>(views.size());
  Tracks tracks = JoinMatches(views, *pairs);
  std::optional<SurveyState> known;
  {
    const StageScope stage(stages_, "grow map");
    std::optional<SurveyGrowth> growth =
        FindStart(tracks, px, RankStartPairs(*pairs, px, taken, camera_.width), lens_, taken,
                  camera_.width, options_, stop);
    if (!growth) return std::nullopt;
    growth->Grow(most, taken, stop);
    growth->Finish(stop);
    known = growth->state();
  }
  BuiltSurvey built{std::move(tracks), std::move(*known), px};
  {
    const StageScope stage(stages_, "match pairs");
    MatchOverlaps(views, built, pairs, stop);
  }
  {
    const StageScope stage(stages_, "grow map");
    Tracks all = JoinMatches(views, *pairs);
    SurveyGrowth growth(&all, &px, built.state.lens, options_);
    growth.Resume(built.state);
    growth.Grow(most, taken, stop);
    growth.Finish(stop);
    built = {std::move(all), growth.state(), px};
    KeepLensOneToOne(stop, &built);
  }
  Sharpen(views, stop, &built);
  return built;
}

void SurveyMapper::Sharpen(const std::vector<SurveyView>& views, const std::function<bool()>& stop,
                           BuiltSurvey* built) {
  {
    const StageScope stage(stages_, "align patches");
    const PatchSurvey survey{&views, CameraOf(built->state.lens), keeps_distortion_,
                             measuring_.patches};
    const int measured = MeasureTracks(survey, built->tracks, built->state, &built->px);
    Log().debug("{} sights were measured by patches", measured);
    if (measured == 0) return;
  }
  const StageScope stage(stages_, "sharpen map");
  built->state.model_sigma_px = measuring_.model_noise.initial_sigma_px;
  built->state.image_rows = camera_.height;
  AdjustMeasured(views, stop, built);
  if (lens_.is_refined) RefineWholly(views, stop, built);
}

void SurveyMapper::AdjustMeasured(const std::vector<SurveyView>& views,
                                  const std::function<bool()>& stop, BuiltSurvey* built) {
  constexpr int kMostRounds = 2;
  constexpr double kSameWeights = 0.25;  // Change of the model's errors that hardly moves the map.
  for (int round = 0; round < kMostRounds; ++round) {
    if (built->state.lens.is_refined_wholly)
      built->state.velocity_world = ViewVelocities(views, built->state);
    SurveyGrowth growth(&built->tracks, &built->px, built->state.lens, options_);
    growth.Resume(built->state);
    growth.Finish(stop);
    const double assumed_px = built->state.model_sigma_px;
    built->state = growth.state();
    const double found_px =
        ModelSigmaPx(built->tracks, built->px, built->state, measuring_.model_noise);
    built->state.model_sigma_px = found_px;
    Log().debug("patches err by {:.3f} px beyond their own noise; readout {:.4f} s", found_px,
                built->state.lens.camera.readout_s);
    if (std::abs(found_px - assumed_px) <= kSameWeights * assumed_px) return;
  }
}

/// A lens of which a rest stays unexplained bends otherwise: more parameters would take on what
/// they don't mean. Few views, or views under one heading, explain all and tell nothing.
void SurveyMapper::RefineWholly(const std::vector<SurveyView>& views,
                                const std::function<bool()>& stop, BuiltSurvey* built) {
  BuiltSurvey whole = *built;
  whole.state.lens.is_refined_wholly = true;
  AdjustMeasured(views, stop, &whole);
  if (whole.state.model_sigma_px > options_.max_model_sigma_px) return;
  const auto lens = DescribeLens(whole.tracks, whole.px, options_, whole.state);
  const double limit = options_.max_lens_sigma;
  if (!lens || lens->sigmas.focal > limit || lens->sigmas.centre > limit) return;
  *built = std::move(whole);
  KeepLensOneToOne(stop, built);
}

/// Where few photographs tell the lens's bend at their corners, it may fold over there.
void SurveyMapper::KeepLensOneToOne(const std::function<bool()>& stop, BuiltSurvey* built) {
  SurveyLens& lens = built->state.lens;
  const double corner_px =
      std::hypot(std::max(lens.camera.pinhole.cx, camera_.width - 1 - lens.camera.pinhole.cx),
                 std::max(lens.camera.pinhole.cy, camera_.height - 1 - lens.camera.pinhole.cy));
  if (!lens.is_refined || lens.IsOneToOne(corner_px)) return;
  Log().warn(
      "the radial distortion found (k1 {:.3f}, k2 {:.3f}) folds over inside the image: none "
      "is used",
      lens.camera.k1, lens.camera.k2);
  lens.camera.k1 = lens.camera.k2 = lens.camera.p1 = lens.camera.p2 = 0;
  lens.is_refined = false;
  SurveyGrowth growth(&built->tracks, &built->px, lens, options_);
  growth.Resume(built->state);
  growth.Finish(stop);
  built->state = growth.state();
}

Camera SurveyMapper::CameraOf(const SurveyLens& lens) const {
  Camera camera = camera_;
  camera.pinhole = lens.camera.pinhole;
  if (lens.camera.IsUndistorted()) return camera;
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {lens.camera.k1, lens.camera.k2, lens.camera.p1, lens.camera.p2};
  return camera;
}

SurveyOutcome SurveyMapper::Run(const std::vector<SurveyView>& views,
                                const std::function<bool()>& stop) {
  SurveyOutcome outcome;
  outcome.camera = camera_;
  outcome.places.resize(views.size());
  std::vector<MatchedPair> pairs;
  {
    const StageScope stage(stages_, "match pairs");
    const std::vector<PairCandidate> candidates = ChoosePairs(views, eyes_.vocabulary, options_);
    tried_ = {candidates.begin(), candidates.end()};
    pairs = PairMatching(&views, eyes_.quick, eyes_.learned, options_).Match(candidates, stop);
    Log().info("{} of {} pairs of photographs show the same ground", pairs.size(),
               candidates.size());
  }
  const ViewPixels px = PixelsOf(views);
  std::set<int> taken;
  const bool was_refined = lens_.is_refined;
  while (!(stop && stop() && !taken.empty())) {
    const std::optional<BuiltSurvey> built = Build(views, px, taken, &pairs, stop);
    if (!built) break;
    if (taken.empty()) {
      // The first map is the largest as a rule, and tells the lens to the others.
      lens_ = built->state.lens;
      outcome.lens = DescribeLens(built->tracks, built->px, options_, built->state);
      lens_.is_refined = false;
      if (was_refined) outcome.camera = CameraOf(lens_);
    }
    const std::set<int> mapped = ViewsIn(built->state);
    taken.insert(mapped.begin(), mapped.end());
    const MapId map = outcome.atlas.NextMap();
    const std::vector<KeyframeId> keyframes =
        AddSurveyMap(views, *built, outcome.camera, keeps_distortion_, &outcome.atlas);
    for (size_t v = 0; v < keyframes.size(); ++v) {
      if (keyframes[v].valid()) outcome.places[v] = {map, keyframes[v]};
    }
  }
  return outcome;
}

}  // namespace deepuav
