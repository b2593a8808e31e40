#pragma once

#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/map/atlas.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// Adds a map of what is known to the atlas, a keyframe each photograph that has a pose, its key
/// points undistorted by `camera`. The unit of length is the median depth of the first one. Gives
/// the keyframe of each view, invalid where there is none.
std::vector<KeyframeId> AddSurveyMap(const std::vector<SurveyView>& views, const Tracks& tracks,
                                     const SurveyState& state, const Camera& camera, Atlas* atlas);

}  // namespace deepuav
