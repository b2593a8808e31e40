#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "deepuav/image/image.h"

namespace deepuav {

// Each gives the bytes of a file.

/// `format`: jpg or png.
std::string EncodeImage(const GreyImage& image, const std::string& format, int jpeg_quality);

/// 16-bit PNG in units of `unit_m`; 0 where there is no depth or it is too large.
std::string EncodeDepth(const cv::Mat1f& depth_m, double unit_m);

/// 8-bit PNG of values as they are.
std::string EncodeMask(const cv::Mat1b& mask);

/// 16-bit PNG as in KITTI (Menze and Geiger 2015): red and green hold 64 u + 2^15 and 64 v + 2^15,
/// blue is 1 where there is a flow.
std::string EncodeFlow(const cv::Mat2f& flow_px);

}  // namespace deepuav
