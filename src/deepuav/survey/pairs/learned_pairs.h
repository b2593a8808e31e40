#pragma once

#include <functional>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "deepuav/survey/pairs/view_pairs.h"

namespace deepuav {

/// What a learned matcher says of photographs that another one left outside of a map: it knows them
/// under any heading as they are, but takes longer. It is asked once for a pair. Thread-compatible.
class LearnedPairs {
 public:
  /// The pointers must outlive it; `matcher` may be null, which finds nothing.
  LearnedPairs(const std::vector<SurveyView>* views, Matcher* matcher,
               const SurveyOptions& options);

  /// From now on `progress` is told how many of what was tried are done.
  void Tell(std::function<void(int done, int total)> progress) { progress_ = std::move(progress); }

  /// To `pairs`, those of `tried` that concern one in `outside` and none in `taken`, where more
  /// matches agree with one epipolar geometry than there are. False where there is none.
  bool Add(const std::set<PairCandidate>& tried, const std::set<int>& outside,
           const std::set<int>& taken, std::vector<MatchedPair>* pairs,
           const std::function<bool()>& stop);

 private:
  /// Empty where they don't show the same ground.
  const std::vector<Match>& MatchesOf(std::pair<int, int> pair);

  const std::vector<SurveyView>* views_;
  Matcher* matcher_;
  SurveyOptions options_;
  std::map<std::pair<int, int>, std::vector<Match>> asked_;
  std::function<void(int, int)> progress_;
};

}  // namespace deepuav
