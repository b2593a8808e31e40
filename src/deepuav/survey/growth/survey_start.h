#pragma once

#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "deepuav/survey/growth/survey_growth.h"

namespace deepuav {

/// The pairs that a map may start with, the most promising first: many matches that have moved.
std::vector<const MatchedPair*> RankStartPairs(const std::vector<MatchedPair>& pairs,
                                               const ViewPixels& px, const std::set<int>& taken,
                                               double image_width_px);

/// The start of a map, some photographs large, under the focal length under which they agree best:
/// that of `lens`, or where it is refined another from 0.36 to 2.8 times as long. Nothing where no
/// pair of photographs starts a map.
std::optional<SurveyGrowth> FindStart(const Tracks& tracks, const ViewPixels& px,
                                      const std::vector<const MatchedPair*>& pairs,
                                      const SurveyLens& lens, const std::set<int>& taken,
                                      double image_width_px, const SurveyOptions& options,
                                      const std::function<bool()>& stop);

}  // namespace deepuav
