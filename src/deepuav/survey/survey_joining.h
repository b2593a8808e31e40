#pragma once

#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "deepuav/survey/survey_options.h"
#include "deepuav/survey/survey_state.h"
#include "deepuav/survey/view_pairs.h"

namespace deepuav {

/// A photograph that matches each of the map's photographs in points of its own has a place beside
/// each of them, yet sees no point of the map: points are what two of them see. Several such make a
/// map of their own. Where that grows into photographs of `map`, it is brought to it by these.
/// Gives the poses of all, points not made anew; nothing where no map comes of those outside. Those
/// of `taken` belong to others. `map` must be of all `pairs`.
std::optional<SurveyState> JoinOutside(const BuiltSurvey& map,
                                       const std::vector<MatchedPair>& pairs,
                                       const std::set<int>& taken, double image_width_px,
                                       const SurveyOptions& options,
                                       const std::function<bool()>& stop);

}  // namespace deepuav
