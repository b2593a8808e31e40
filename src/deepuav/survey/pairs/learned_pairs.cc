#include "deepuav/survey/pairs/learned_pairs.h"

#include "deepuav/base/logging.h"

namespace deepuav {

LearnedPairs::LearnedPairs(const std::vector<SurveyView>* views, Matcher* matcher,
                           const SurveyOptions& options)
    : views_(views), matcher_(matcher), options_(options) {}

bool LearnedPairs::Add(const std::set<PairCandidate>& tried, const std::set<int>& outside,
                       const std::set<int>& taken, std::vector<MatchedPair>* pairs,
                       const std::function<bool()>& stop) {
  if (!matcher_ || outside.empty()) return false;
  std::map<std::pair<int, int>, size_t> numbers;
  for (size_t i = 0; i < pairs->size(); ++i) numbers[{(*pairs)[i].a, (*pairs)[i].b}] = i;
  int found = 0, done = 0;
  for (const PairCandidate& candidate : tried) {
    if (progress_) progress_(done++, static_cast<int>(tried.size()));
    const auto [a, b] = std::pair(candidate.a, candidate.b);
    if (!outside.contains(a) && !outside.contains(b)) continue;
    if (taken.contains(a) || taken.contains(b)) continue;
    if (stop && stop()) break;
    const std::vector<Match>& matches = MatchesOf({a, b});
    const auto known = numbers.find({a, b});
    const bool is_known = known != numbers.end();
    if (matches.size() <= (is_known ? (*pairs)[known->second].matches.size() : 0)) continue;
    if (is_known) {
      (*pairs)[known->second] = {a, b, matches};
    } else {
      numbers[{a, b}] = pairs->size();
      pairs->push_back({a, b, matches});
    }
    ++found;
  }
  Log().debug("{} photographs outside: {} pairs have more matches by the learned matcher",
              outside.size(), found);
  return found > 0;
}

const std::vector<Match>& LearnedPairs::MatchesOf(std::pair<int, int> pair) {
  const auto [at, is_new] = asked_.try_emplace(pair);
  if (!is_new) return at->second;
  PairMatching matching(views_, matcher_, nullptr, options_);
  const auto found = matching.Match({{.a = pair.first, .b = pair.second}}, nullptr);
  if (!found.empty()) at->second = found.front().matches;
  return at->second;
}

}  // namespace deepuav
