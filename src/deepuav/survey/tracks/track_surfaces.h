#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/patches/surface_normals.h"
#include "deepuav/survey/survey_state.h"

namespace deepuav {

/// The surface that each point lies on, as one view of the point shows it through the points that
/// it sees around: by track, a normal of length 1 in the world, towards the view. Nothing where
/// `view_of_track` is -1, where the track has no point, or where that lies behind the view.
std::vector<std::optional<Eigen::Vector3d>> TrackNormals(const Tracks& tracks, const ViewPixels& px,
                                                         const SurveyState& state,
                                                         const std::vector<int>& view_of_track,
                                                         const SurfaceNormalOptions& options,
                                                         int threads);

}  // namespace deepuav
