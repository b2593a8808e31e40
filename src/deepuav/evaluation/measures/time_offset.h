#pragma once

#include "deepuav/evaluation/measures/evaluation.h"

namespace deepuav {

/// The offset to add to the estimate's time stamps, within `options.search_offset_s` of
/// options.association.time_offset_s, under which the estimate, interpolated at the truth's moments
/// and aligned, lies nearest to the truth (root of the mean squared distance over that of the truth
/// from its mean: where it rests, nothing tells the offset; horizontal for a truth without
/// altitude). First a grid over the offsets under which the two overlap in time, then Brent's
/// method about its best point. Offsets under which less than half of the most moments are left do
/// not count. Throws Error where the best lies at the end of the range, and where no offset can be
/// aligned.
double SearchTimeOffset(const Truth& truth, const Trajectory& estimate,
                        const EvaluationOptions& options);

}  // namespace deepuav
