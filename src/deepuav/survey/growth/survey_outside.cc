#include <iterator>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/survey/growth/survey_joining.h"
#include "deepuav/survey/pairs/reduced_views.h"
#include "deepuav/survey/survey_mapper.h"

namespace deepuav {

std::set<int> SurveyMapper::Outside(const SurveyState& known, const std::set<int>& taken) const {
  std::set<int> outside;
  for (size_t v = 0; v < views_.size(); ++v) {
    const int view = static_cast<int>(v);
    if (!known.cam_from_world[v] && !taken.contains(view)) outside.insert(view);
  }
  return outside;
}

/// Photographs that stayed outside of the map may be from another height than those they overlap,
/// or blurred.
bool SurveyMapper::MatchReduced(const SurveyState& known, const std::set<int>& taken,
                                std::vector<MatchedPair>* pairs,
                                const std::function<bool()>& stop) {
  const std::set<int> outside = Outside(known, taken);
  if (!eyes_.reduced || outside.empty()) return false;
  for (SurveyView& view : views_) {
    if (stop && stop()) return false;
    DescribeMissingHeadings(eyes_.turned, eyes_.turned_file, &view);
    LookReduced(camera_, eyes_.reduced, &view);
  }
  px_ = PixelsOfViews();
  std::vector<PairCandidate> candidates;
  for (const PairCandidate& pair :
       ChooseReducedPairs(views_, outside, eyes_.vocabulary, options_)) {
    if (tried_.insert(pair).second) candidates.push_back(pair);
  }
  std::vector<MatchedPair> more = Matching().Match(candidates, stop);
  Log().debug("{} photographs outside: {} of {} pairs were matched reduced", outside.size(),
              more.size(), candidates.size());
  for (MatchedPair& pair : more) pairs->push_back(std::move(pair));
  return !more.empty();
}

/// Photographs that stayed outside of the map come in by matches of other kinds.
void SurveyMapper::BringIn(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                           const std::function<bool()>& stop, BuiltSurvey* built) {
  const auto match = [&](const auto& matching) {
    const StageScope stage(stages_, "match pairs");
    return matching();
  };
  std::vector<MatchedPair> more = *pairs;
  if (match([&] { return MatchReduced(built->state, taken, &more, stop); })) {
    BuiltSurvey grown = *built;
    GrowFurther(taken, more, stop, &grown);
    // Matches that bring nobody in are more likely wrong than those there are.
    if (grown.state.ViewCount() > built->state.ViewCount()) {
      *built = std::move(grown);
      *pairs = std::move(more);
    }
  }
  // These are kept as they are: a map beside this one may be joined to it by them.
  const std::set<int> outside = Outside(built->state, taken);
  if (match([&] { return learned_->Add(tried_, outside, taken, pairs, stop); }))
    GrowFurther(taken, *pairs, stop, built);
}

/// Maps of photographs that stayed outside, where most of what leads from them to the map agrees.
bool SurveyMapper::Join(const std::set<int>& taken, const std::vector<MatchedPair>& pairs,
                        const std::function<bool()>& stop, BuiltSurvey* built) {
  const StageScope stage(stages_, "grow map");
  std::optional<BuiltSurvey> both;
  const auto accept = [&](const SurveyState& joined) {
    SurveyGrowth growth(&built->tracks, &px_, built->state.lens, options_);
    growth.Resume(joined);
    growth.Settle(stop);
    both = *built;
    both->state = growth.state();
    return ExplainsWhatLeads(built->state, *both, pairs);
  };
  if (!JoinOutside(*built, pairs, taken, camera_.width, options_, stop, accept)) return false;
  *built = std::move(*both);
  return true;
}

/// Most of the matches that lead from a map to photographs that `both` has as well. Of maps that
/// belong together 0.7 to all are explained, of others less than 0.6.
bool SurveyMapper::ExplainsWhatLeads(const SurveyState& map, const BuiltSurvey& both,
                                     const std::vector<MatchedPair>& pairs) const {
  constexpr double kLeastExplained = 0.65;
  const PairJudge judge = JudgeOfPairs();
  ptrdiff_t leading = 0, explained = 0;  // Matches.
  for (const MatchedPair& pair : pairs) {
    const bool leads =
        map.Has(pair.a) != map.Has(pair.b) && both.state.Has(pair.a) && both.state.Has(pair.b);
    if (!leads) continue;
    leading += std::ssize(pair.matches);
    if (judge.IsExplained(pair, both)) explained += std::ssize(pair.matches);
  }
  Log().debug("{} photographs outside join the map, which explains {} of {} matches with it",
              both.state.ViewCount() - map.ViewCount(), explained, leading);
  return leading > 0 &&
         static_cast<double>(explained) >= kLeastExplained * static_cast<double>(leading);
}

}  // namespace deepuav
