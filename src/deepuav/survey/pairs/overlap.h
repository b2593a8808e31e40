#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// Pairs of photographs of which the map says that one shows enough of what the other sees, for
/// each those that overlap most. By rising a and b.
std::vector<PairCandidate> OverlappingPairs(const Tracks& tracks, const SurveyState& state,
                                            const cv::Size& image_size,
                                            const SurveyOptions& options);

}  // namespace deepuav
