#pragma once

#include <cstdint>
#include <opencv2/calib3d.hpp>

namespace deepuav {

/// OpenCV's USAC (Raguram et al. 2013) so set that its result depends on its arguments alone:
/// uniform sampling, MSAC score, local optimisation, one thread. `threshold` is in the unit of the
/// points.
cv::UsacParams MakeUsacParams(double threshold, double confidence, int max_iterations,
                              uint64_t seed);

}  // namespace deepuav
