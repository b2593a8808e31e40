#pragma once

#include <set>
#include <vector>

#include "deepuav/features/extractor.h"
#include "deepuav/features/turned_describer.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/place/vocabulary.h"
#include "deepuav/survey/pairs/view_pairs.h"

namespace deepuav {

/// Looks at the photograph at half and at a quarter of its size, as it would look from two and from
/// four times the distance: appends the key points to the frame's, in pixels of the whole image. A
/// photograph without an image, or looked at before, stays as it is.
void LookReduced(const Camera& camera, LenslessExtractor* extractor, SurveyView* view);

/// Describes the key points of the photograph, not yet looked at reduced, under the headings that
/// are missing, where some are there: of a pair only the one that is not reduced is seen turned.
/// `describer` may be null, and `file`: the descriptors are then kept in memory.
void DescribeMissingHeadings(TurnedDescriber* describer, TemporaryFile* file, SurveyView* view);

/// Pairs of `outside` with any others, of which one, or both alike, are seen reduced: neighbours in
/// the order of the photographs, and those that it looks like. All views were looked at reduced. By
/// rising a and b.
std::vector<PairCandidate> ChooseReducedPairs(const std::vector<SurveyView>& views,
                                              const std::set<int>& outside,
                                              const Vocabulary* vocabulary,
                                              const SurveyOptions& options);

}  // namespace deepuav
