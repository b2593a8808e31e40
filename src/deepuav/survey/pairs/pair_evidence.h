#pragma once

#include <Eigen/Core>
#include <opencv2/core/types.hpp>
#include <vector>

#include "deepuav/survey/growth/torn_ties.h"
#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// Of the ground that both photographs see, if a homography leads from one to the other, the share
/// over which their matches spread, the lesser as seen by either. Photographs of the same ground
/// match all over it; of places that merely look alike (roofs of a kind, containers, rows of a
/// field) what is alike matches and nothing beside it. 0 where too little is seen to say.
double MatchCoverage(const Features& a, const Features& b, const std::vector<Match>& matches,
                     const cv::Size& image_size, const PairEvidenceOptions& options);

/// Whether a map and the matches of photographs agree. The arguments of the constructor must
/// outlive it.
class PairJudge {
 public:
  /// `px` as detected.
  PairJudge(const std::vector<SurveyView>& views, const ViewPixels& px, const cv::Size& image_size,
            const SurveyOptions& options);

  /// The share of its matches of which the map has what one photograph shows where the other one
  /// shows it, or, where it has too few of their points, that lie on the epipolar lines of its
  /// poses. Both photographs must be in the map.
  double AgreeingShare(const MatchedPair& pair, const BuiltSurvey& map) const;
  bool IsExplained(const MatchedPair& pair, const BuiltSurvey& map) const;

  /// Pairs (by their number) with many matches all over what both see, that the map puts
  /// elsewhere: in a right map there are none.
  std::vector<size_t> Contradicting(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const;
  /// Takes those out of the pairs that match over a part only of what both would see, and hold a
  /// photograph that others contradict or are not of the map either; or, as what is wrong may hang
  /// on it by others, `everywhere`. False: no photograph is doubtful, or none is taken out.
  bool SetSuspectsAside(const BuiltSurvey& map, bool everywhere, std::vector<MatchedPair>* pairs,
                        std::vector<MatchedPair>* suspects) const;
  /// What the pairs say that the map explains, less what those say that contradict it.
  double Agreement(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const;
  /// Views of which the pairs that contradict the map say much beside the others.
  std::vector<int> Doubtful(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const;
  /// Views of which these pairs say more than all others.
  std::vector<int> Misplaced(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const;
  /// Views that hold one another, as a whole said more against than for by pairs with others.
  std::vector<int> MisplacedTogether(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const;
  /// Takes those out of the pairs that hold one of `views` where the map has it.
  void SetHoldingAside(const std::vector<int>& views, const BuiltSurvey& map,
                       std::vector<MatchedPair>* pairs, std::vector<MatchedPair>* holding) const;

 private:
  const Eigen::Vector2d& PixelOf(int view, int keypoint) const {
    return px_[static_cast<size_t>(view)][static_cast<size_t>(keypoint)].px;
  }
  bool FitsEpipolarLine(const MatchedPair& pair, const Match& match,
                        const SurveyState& state) const;
  double CoverageOf(MatchedPair* pair) const;
  double WeightOf(MatchedPair* pair) const;
  /// What the pairs say that the map explains, then, negative, those that contradict it.
  std::vector<Tie> TiesIn(std::vector<MatchedPair>* pairs, const BuiltSurvey& map) const;
  std::vector<int> Contradicted(double ratio, std::vector<MatchedPair>* pairs,
                                const BuiltSurvey& map) const;

  const std::vector<SurveyView>& views_;
  const ViewPixels& px_;
  const cv::Size image_size_;
  const SurveyOptions& options_;
};

}  // namespace deepuav
