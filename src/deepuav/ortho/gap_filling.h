#pragma once

#include <opencv2/core.hpp>

namespace deepuav {

/// Gives every NaN the value of a smooth surface (a membrane) through the values that are there,
/// which stay. Does nothing where there are none.
void FillGaps(cv::Mat1f* values);

}  // namespace deepuav
