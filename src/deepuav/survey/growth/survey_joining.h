#pragma once

#include <functional>
#include <set>
#include <vector>

#include "deepuav/survey/pairs/view_pairs.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// A photograph that matches each of the map's photographs in points of its own has a place beside
/// each of them, yet sees no point of the map: points are what two of them see. Several such make a
/// map of their own, or with one of the map's photographs. Where that grows into photographs of
/// `map`, it is brought to it by these. `accept` gets the poses of all, points not made anew, of
/// one such map after the other until it says yes: then this is true. Those of `taken` belong to
/// others. `map` must be of all `pairs` and outlive the call unchanged until `accept` says yes.
bool JoinOutside(const BuiltSurvey& map, const std::vector<MatchedPair>& pairs,
                 const std::set<int>& taken, double image_width_px, const SurveyOptions& options,
                 const std::function<bool()>& stop,
                 const std::function<bool(const SurveyState&)>& accept);

}  // namespace deepuav
