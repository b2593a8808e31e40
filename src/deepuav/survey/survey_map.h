#pragma once

#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/map/atlas.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// Adds a map of what is known to the atlas, a keyframe each photograph that has a pose, its key
/// points and what patches measured undistorted by `camera` (`keeps_distortion`: the survey's
/// pixels are of the images as taken). The unit of length is the median depth of the first one.
/// Gives the keyframe of each view, invalid where there is none.
std::vector<KeyframeId> AddSurveyMap(const std::vector<SurveyView>& views,
                                     const BuiltSurvey& survey, const Camera& camera,
                                     bool keeps_distortion, Atlas* atlas);

}  // namespace deepuav
