#pragma once

#include <cstdint>
#include <opencv2/core/types.hpp>
#include <optional>
#include <span>

namespace deepuav {

/// The width and height that the header of a JPEG, PNG, TIFF, BMP or WebP file claims, before
/// anything is decoded; nothing for other formats and damaged headers.
std::optional<cv::Size2d> EncodedSize(std::span<const uint8_t> bytes);

}  // namespace deepuav
