#pragma once

#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "deepuav/features/turned_describer.h"
#include "deepuav/map/frame.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/place/vocabulary.h"
#include "deepuav/survey/survey_options.h"

namespace deepuav {

/// A photograph as the survey sees it.
struct SurveyView {
  Frame frame;
  TurnedDescriptors turned;  ///< Of the same key points under other headings, or without rows.
};

/// Two photographs that may show the same ground.
struct PairCandidate {
  int a = 0, b = 0;
  int quarter_turns = 0;  ///< Clockwise, of a, after which it looks like b.

  auto operator<=>(const PairCandidate&) const = default;
};

/// Two photographs that show the same ground: a < b, the matches agree with one epipolar geometry.
struct MatchedPair {
  int a = 0, b = 0;
  std::vector<Match> matches;
};

/// Pairs by the order of the photographs and by what they look like under every heading, the order
/// deciding nothing where `vocabulary` is there. By rising a and b.
std::vector<PairCandidate> ChoosePairs(const std::vector<SurveyView>& views,
                                       const Vocabulary* vocabulary, const SurveyOptions& options);

/// Matches pairs of photographs whose lens is not known: an epipolar geometry of the pixels as they
/// are must hold for them.
class PairMatching {
 public:
  /// `learned` (may be null) is asked where the quick matcher finds little between photographs
  /// taken one after the other. The pointers must outlive it.
  PairMatching(const std::vector<SurveyView>* views, Matcher* quick, Matcher* learned,
               const SurveyOptions& options);

  /// Of several headings of one pair the one with most matches counts. `stop` ends it early.
  std::vector<MatchedPair> Match(const std::vector<PairCandidate>& candidates,
                                 const std::function<bool()>& stop);

 private:
  std::vector<deepuav::Match> MatchCandidate(const PairCandidate& candidate);
  std::vector<deepuav::Match> Verify(const PairCandidate& candidate,
                                     const std::vector<deepuav::Match>& matches) const;

  const std::vector<SurveyView>* views_;
  Matcher* quick_;
  Matcher* learned_;
  const SurveyOptions options_;
};

}  // namespace deepuav
