#include "deepuav/survey/survey_mapper.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/survey/growth/survey_start.h"
#include "deepuav/survey/pairs/overlap.h"
#include "deepuav/survey/pairs/pair_choice.h"
#include "deepuav/survey/survey_map.h"

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
  constexpr double kInDoubt = 0.3;  // A lens of which that is said may have any distortion.
  if (focal_sigma < kInDoubt) lens_.radial_guess = {radial->first, radial->second};
}

ViewPixels SurveyMapper::PixelsOfViews() const {
  ViewPixels px;
  for (const SurveyView& view : views_) {
    std::vector<SightPixel>& of_view = px.emplace_back();
    const auto as_it_is = static_cast<size_t>(view.FeaturesAt(0).size());
    for (const Keypoint& keypoint : view.frame.features->keypoints) {
      of_view.push_back({(keeps_distortion_ ? keypoint.image_px : keypoint.px).cast<double>()});
      if (of_view.size() > as_it_is) of_view.back().noise = keypoint.sigma_px;
    }
  }
  return px;
}

void SurveyMapper::MatchOverlaps(const BuiltSurvey& built, std::vector<MatchedPair>* pairs,
                                 const std::function<bool()>& stop) {
  std::set<std::pair<int, int>> matched;
  for (const MatchedPair& pair : *pairs) matched.emplace(pair.a, pair.b);
  std::vector<PairCandidate> candidates;
  for (const PairCandidate& pair :
       OverlappingPairs(built.tracks, built.state, {camera_.width, camera_.height}, options_)) {
    if (matched.contains({pair.a, pair.b})) continue;
    if (tried_.insert(pair).second) candidates.push_back(pair);
  }
  std::vector<MatchedPair> more = Matching().Match(candidates, stop);
  Log().debug("{} of {} more pairs that overlap were matched", more.size(), candidates.size());
  for (MatchedPair& pair : more) pairs->push_back(std::move(pair));
}

/// From the poses that are known, with all matches that there are.
void SurveyMapper::GrowFurther(const std::set<int>& taken, const std::vector<MatchedPair>& pairs,
                               const std::function<bool()>& stop, BuiltSurvey* built) {
  const StageScope stage(stages_, "grow map");
  Tracks all = JoinMatches(views_, pairs);
  SurveyGrowth growth(&all, &px_, built->state.lens, options_);
  growth.Resume(built->state);
  GrowAll(taken, stop, &growth);
  SurveyState grown = growth.state();
  *built = {std::move(all), std::move(grown), px_};
}

/// By the pairs that there are.
std::optional<BuiltSurvey> SurveyMapper::BeginMap(const std::set<int>& taken,
                                                  const std::vector<MatchedPair>& pairs,
                                                  const std::function<bool()>& stop) {
  Tracks tracks = JoinMatches(views_, pairs);
  const StageScope stage(stages_, "grow map");
  std::optional<SurveyGrowth> growth =
      FindStart(tracks, px_, RankStartPairs(pairs, px_, taken, camera_.width), lens_, taken,
                camera_.width, options_, stop);
  if (!growth) return std::nullopt;
  GrowAll(taken, stop, &*growth);
  SurveyState known = growth->state();
  return BuiltSurvey{std::move(tracks), std::move(known), px_};
}

/// By what overlaps as the map has it, and by maps of what is outside of it.
void SurveyMapper::CompleteMap(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                               const std::function<bool()>& stop, BuiltSurvey* built) {
  do {
    constexpr int kMostRounds = 3;
    int before = 0;
    for (int round = 0; round < kMostRounds && built->state.ViewCount() > before; ++round) {
      before = built->state.ViewCount();
      {
        const StageScope stage(stages_, "match pairs");
        MatchOverlaps(*built, pairs, stop);
      }
      GrowFurther(taken, *pairs, stop, built);
    }
  } while (Join(taken, *pairs, stop, built));
}

std::optional<BuiltSurvey> SurveyMapper::MakeMap(const std::set<int>& taken,
                                                 std::vector<MatchedPair>* pairs,
                                                 const std::function<bool()>& stop) {
  std::optional<BuiltSurvey> built = BeginMap(taken, *pairs, stop);
  if (!built) return std::nullopt;
  BringIn(taken, pairs, stop, &*built);
  CompleteMap(taken, pairs, stop, &*built);
  return built;
}

/// Whether the focal length is more than what takes on a rest that stays unexplained. All of a lens
/// is refined only where it is told.
bool SurveyMapper::TellsFocal(const BuiltSurvey& built) const {
  if (built.state.lens.is_refined && built.state.lens.is_refined_wholly) return true;
  const auto lens = DescribeLens(built.tracks, built.px, options_, built.state);
  const double rest = std::max(1.0, built.state.model_sigma_px / options_.max_model_sigma_px);
  return lens && rest * lens->sigmas.focal <= options_.max_lens_sigma;
}

/// All photographs may tell the focal length that the first ones did not.
std::optional<BuiltSurvey> SurveyMapper::FreeFocal(const std::set<int>& taken,
                                                   const std::vector<MatchedPair>& pairs,
                                                   const SurveySharpening& sharpening,
                                                   const std::function<bool()>& stop,
                                                   BuiltSurvey built) {
  built.state.lens.holds_focal = false;
  GrowFurther(taken, pairs, stop, &built);
  sharpening.KeepLensOneToOne(stop, &built);
  sharpening.Sharpen(stop, &built);
  const bool is_told = TellsFocal(built);
  Log().debug("all photographs {} the focal length: {:.0f} px", is_told ? "tell" : "don't tell",
              built.state.lens.camera.pinhole.fx);
  return is_told ? std::optional(std::move(built)) : std::nullopt;
}

std::optional<BuiltSurvey> SurveyMapper::Build(const std::set<int>& taken,
                                               std::vector<MatchedPair>* pairs,
                                               const std::function<bool()>& stop) {
  std::optional<BuiltSurvey> built = MakeMap(taken, pairs, stop);
  if (!built) return std::nullopt;
  ResolveContradictions(taken, pairs, stop, &*built);
  const SurveySharpening sharpening(&views_, camera_, keeps_distortion_, options_, measuring_,
                                    stages_);
  std::optional<BuiltSurvey> freed;
  if (built->state.lens.is_refined && built->state.lens.holds_focal)
    freed = FreeFocal(taken, *pairs, sharpening, stop, *built);
  if (freed) {
    built = std::move(freed);
  } else {
    sharpening.KeepLensOneToOne(stop, &*built);
    sharpening.Sharpen(stop, &*built);
  }
  // Only what stays outside is matched after this.
  for (const int view : ViewsIn(built->state))
    views_[static_cast<size_t>(view)].turned.fill(StoredDescriptors());
  return built;
}

bool SurveyMapper::IsRefuted(const BuiltSurvey& built, std::vector<MatchedPair>* pairs) const {
  const double agreement = JudgeOfPairs().Agreement(pairs, built);
  if (agreement >= 0) return false;
  Log().warn("a map of {} photographs is left out: what they match contradicts it",
             built.state.ViewCount());
  return true;
}

std::function<void(int, int)> SurveyMapper::Telling(const char* what) const {
  if (!watch_) return nullptr;
  return [this, what](int done, int total) { watch_->OnWork(what, done, total); };
}

PairMatching SurveyMapper::Matching() const {
  PairMatching matching(&views_, eyes_.quick, eyes_.learned, options_);
  matching.Tell(Telling("pairs"));
  return matching;
}

void SurveyMapper::GrowAll(const std::set<int>& taken, const std::function<bool()>& stop,
                           SurveyGrowth* growth) const {
  const auto all = static_cast<int>(views_.size());
  if (watch_) {
    growth->Watch([this, all](const SurveyState& state) {
      watch_->OnWork("photographs in the map", state.ViewCount(), all);
      watch_->OnGrowth(next_map_, state);
    });
  }
  growth->Grow(all, taken, stop);
  growth->Settle(stop);
}

PairJudge SurveyMapper::JudgeOfPairs() const {
  return {views_, px_, {camera_.width, camera_.height}, options_};
}

SurveyOutcome SurveyMapper::Run(std::vector<SurveyView> views, const std::function<bool()>& stop) {
  views_ = std::move(views);
  tried_.clear();
  learned_.emplace(&views_, eyes_.of_outside, options_);
  learned_->Tell(Telling("pairs"));
  SurveyOutcome outcome;
  outcome.camera = camera_;
  outcome.places.resize(views_.size());
  std::vector<MatchedPair> pairs;
  {
    const StageScope stage(stages_, "match pairs");
    const std::vector<PairCandidate> candidates = ChoosePairs(views_, eyes_.vocabulary, options_);
    tried_ = {candidates.begin(), candidates.end()};
    pairs = Matching().Match(candidates, stop);
    Log().info("{} of {} pairs of photographs show the same ground", pairs.size(),
               candidates.size());
  }
  px_ = PixelsOfViews();
  std::set<int> taken;
  const bool was_refined = lens_.is_refined;
  while (!(stop && stop() && !taken.empty())) {
    next_map_ = outcome.atlas.NextMap();
    const std::optional<BuiltSurvey> built = Build(taken, &pairs, stop);
    if (!built || built->state.ViewCount() == 0) break;
    const std::set<int> mapped = ViewsIn(built->state);
    taken.insert(mapped.begin(), mapped.end());
    const bool is_cut_short = stop && stop();
    if (!is_cut_short && IsRefuted(*built, &pairs)) continue;
    if (outcome.atlas.Remaining().empty()) {
      // The first map is the largest as a rule, and tells the lens to the others.
      lens_ = built->state.lens;
      outcome.lens = DescribeLens(built->tracks, built->px, options_, built->state);
      lens_.is_refined = false;
      if (was_refined) outcome.camera = WithLens(camera_, lens_);
    }
    const std::vector<int> doubtful = JudgeOfPairs().Doubtful(&pairs, *built);
    outcome.doubtful.insert(outcome.doubtful.end(), doubtful.begin(), doubtful.end());
    const MapId map = outcome.atlas.NextMap();
    const std::vector<KeyframeId> keyframes =
        AddSurveyMap(views_, *built, outcome.camera, keeps_distortion_, &outcome.atlas);
    for (size_t v = 0; v < keyframes.size(); ++v) {
      if (keyframes[v].valid()) outcome.places[v] = {map, keyframes[v]};
    }
  }
  views_.clear();
  px_.clear();
  return outcome;
}

}  // namespace deepuav
