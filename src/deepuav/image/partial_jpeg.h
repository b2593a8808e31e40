#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deepuav/image/image.h"

namespace deepuav {

/// What of a JPEG that breaks off can be decoded.
struct PartialJpeg {
  cv::Mat image;             ///< The rows that are lost are of a middle grey.
  double decoded_share = 0;  ///< Of the rows, those before the first that lacks data.
};

enum class JpegColours { kGrey, kBlueGreenRed };

/// Decodes a JPEG without its end, reduced by a factor of 1, 2, 4 or 8. Nothing where the head
/// is no JPEG's, or the picture comes in several scans, as a progressive one's: what lacks its end
/// is then nowhere sharp.
std::optional<PartialJpeg> DecodePartialJpeg(const std::vector<uint8_t>& bytes, int reduction,
                                             JpegColours colours = JpegColours::kGrey);

}  // namespace deepuav
