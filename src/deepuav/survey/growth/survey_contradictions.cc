#include <algorithm>
#include <iterator>

#include "deepuav/base/logging.h"
#include "deepuav/survey/survey_mapper.h"

namespace deepuav {

/// Takes them out and places them by what others say than hold them now, and so those that this
/// leaves misplaced or outside. False where the map does not agree with more then, which stays as
/// it was.
bool SurveyMapper::PlaceElsewhere(std::vector<int> misplaced, const std::set<int>& taken,
                                  std::vector<MatchedPair>* pairs,
                                  const std::function<bool()>& stop, BuiltSurvey* built) {
  if (misplaced.empty()) return false;
  constexpr int kMostSteps = 3;
  const PairJudge judge = JudgeOfPairs();
  const double before = judge.Agreement(pairs, *built);
  double now = before;
  std::vector<MatchedPair> others = *pairs, holding;
  BuiltSurvey again = *built;
  bool is_settled = false;
  for (int step = 0; step < kMostSteps && now <= before && !is_settled; ++step) {
    judge.SetHoldingAside(misplaced, again, &others, &holding);
    for (const int view : misplaced) again.state.cam_from_world[static_cast<size_t>(view)].reset();
    GrowFurther(taken, others, stop, &again);
    if (again.state.ViewCount() < options_.min_map_views) return false;
    now = judge.Agreement(pairs, again);
    Log().debug(
        "with {} photographs placed again by those that contradict them the map agrees with {:.0f} "
        "instead of {:.0f}",
        misplaced.size(), now, before);
    misplaced = judge.Misplaced(pairs, again);
    is_settled = misplaced.empty() && again.state.ViewCount() >= built->state.ViewCount();
  }
  if (now <= before) return false;
  std::ranges::copy_if(holding, std::back_inserter(others),
                       [&](const MatchedPair& pair) { return judge.IsExplained(pair, again); });
  *pairs = std::move(others);
  *built = std::move(again);
  {
    const StageScope stage(stages_, "match pairs");
    MatchOverlaps(*built, pairs, stop);
  }
  GrowFurther(taken, *pairs, stop, built);
  return true;
}

/// Photographs of which others say more against their place than for it, each alone or, where they
/// hold one another, together.
void SurveyMapper::PlaceAgain(const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                              const std::function<bool()>& stop, BuiltSurvey* built) {
  constexpr int kMostRounds = 6;
  const PairJudge judge = JudgeOfPairs();
  for (int round = 0; round < kMostRounds && !(stop && stop()); ++round) {
    if (!PlaceElsewhere(judge.Misplaced(pairs, *built), taken, pairs, stop, built) &&
        !PlaceElsewhere(judge.MisplacedTogether(pairs, *built), taken, pairs, stop, built))
      return;
  }
}

/// Makes the map of what photographs taken soon after one another say alone, as these mostly show
/// the same ground in truth, and keeps it if it agrees with more of what all say. Photographs in no
/// order say little so.
bool SurveyMapper::TrustOrder(bool brings_in, const std::set<int>& taken,
                              std::vector<MatchedPair>* pairs, const std::function<bool()>& stop,
                              BuiltSurvey* built) {
  std::vector<MatchedPair> in_order, others;
  for (const MatchedPair& pair : *pairs)
    (pair.b - pair.a <= options_.sequence_neighbours ? in_order : others).push_back(pair);
  if (in_order.empty() || others.empty() || (stop && stop())) return false;
  auto again = brings_in ? MakeMap(taken, &in_order, stop) : BeginMap(taken, in_order, stop);
  if (!again) return false;
  if (!brings_in) CompleteMap(taken, &in_order, stop, &*again);
  const PairJudge judge = JudgeOfPairs();
  // Of photographs that are not in this map nothing is known: other maps need their pairs.
  const auto is_told = [&](const MatchedPair& pair) {
    return !again->state.Has(pair.a) || !again->state.Has(pair.b) ||
           judge.IsExplained(pair, *again);
  };
  auto contradicting = std::ranges::stable_partition(others, is_told);
  std::vector<MatchedPair> told = in_order;
  told.insert(told.end(), others.begin(), contradicting.begin());
  GrowFurther(taken, told, stop, &*again);
  std::vector<MatchedPair> all = in_order;
  all.insert(all.end(), others.begin(), others.end());
  const double before = judge.Agreement(&all, *built), now = judge.Agreement(&all, *again);
  Log().debug("{} photographs by their order: the map agrees with {:.0f} instead of {:.0f}",
              again->state.ViewCount(), now, before);
  if (now <= before) return false;
  std::erase_if(all, [&](const MatchedPair& pair) {
    return pair.b - pair.a > options_.sequence_neighbours && !is_told(pair);
  });
  *pairs = std::move(all);
  *built = std::move(*again);
  return true;
}

/// What looks alike may hold photographs where they don't belong, against the matches with those
/// that they do overlap. The map is then made again without such matches, and kept if it agrees
/// with more of what the pairs say.
void SurveyMapper::ResolveContradictions(const std::set<int>& taken,
                                         std::vector<MatchedPair>* pairs,
                                         const std::function<bool()>& stop, BuiltSurvey* built) {
  constexpr int kMostRounds = 4;
  PlaceAgain(taken, pairs, stop, built);
  const PairJudge judge = JudgeOfPairs();
  if (judge.Doubtful(pairs, *built).empty()) return;
  for (const bool brings_in : {false, true}) {
    // What a map that is not kept was matched for is to be matched again for others.
    const std::set<PairCandidate> tried = tried_;
    if (!TrustOrder(brings_in, taken, pairs, stop, built)) tried_ = tried;
    if (judge.Doubtful(pairs, *built).empty()) return;
  }
  std::vector<MatchedPair> trusted = *pairs, suspected;
  BuiltSurvey doubtful = *built;
  bool everywhere = false;
  for (int round = 0; round < kMostRounds && !(stop && stop()); ++round) {
    if (!judge.SetSuspectsAside(doubtful, everywhere, &trusted, &suspected)) {
      if (everywhere) return;
      everywhere = true;
      continue;
    }
    std::optional<BuiltSurvey> again = MakeMap(taken, &trusted, stop);
    if (!again) return;
    std::vector<MatchedPair> all = trusted;
    all.insert(all.end(), suspected.begin(), suspected.end());
    const double before = judge.Agreement(&all, *built), now = judge.Agreement(&all, *again);
    Log().debug(
        "without {} matched pairs that are in doubt the map agrees with {:.0f} instead of {:.0f}",
        suspected.size(), now, before);
    doubtful = *again;
    everywhere = now <= before;
    if (everywhere) continue;
    *pairs = trusted;
    std::ranges::copy_if(suspected, std::back_inserter(*pairs),
                         [&](const MatchedPair& pair) { return judge.IsExplained(pair, *again); });
    *built = std::move(*again);
    GrowFurther(taken, *pairs, stop, built);
  }
}

}  // namespace deepuav
