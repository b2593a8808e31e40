#pragma once

#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "deepuav/ortho/photographs.h"
#include "deepuav/ortho/view_choice.h"

namespace deepuav {

/// Colours that the candidates of each node show there.
using NodeColours = std::vector<std::array<cv::Vec3b, kMaxCandidates>>;

/// Reads every photograph once, reduced until a pixel shows about a step of the grid. Candidates
/// whose photograph cannot be read, or lacks these rows, are removed from `choice`; `unreadable`
/// is told of the former.
NodeColours ReadNodeColours(
    const OrthoScene& scene, const Surface& surface, Photographs* photographs, double gsd,
    ViewChoice* choice, const std::function<void(int view, const std::string& why)>& unreadable);

}  // namespace deepuav
