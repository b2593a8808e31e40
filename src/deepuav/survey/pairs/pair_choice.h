#pragma once

#include <vector>

#include "deepuav/place/vocabulary.h"
#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_options.h"

namespace deepuav {

/// Pairs by the order of the photographs, by what they look like under every heading, the order
/// deciding nothing where `vocabulary` is there, and by where they are said to have been taken:
/// these under the heading that makes them most alike, upright without `vocabulary`. By rising a
/// and b.
std::vector<PairCandidate> ChoosePairs(const std::vector<SurveyView>& views,
                                       const Vocabulary* vocabulary, const SurveyOptions& options);

}  // namespace deepuav
