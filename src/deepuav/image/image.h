#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

namespace deepuav {

/// An 8-bit grey image. cv::Mat shares its pixels on copying: treat them as const once the image is
/// made.
using GreyImage = cv::Mat1b;

/// Decodes an image file as grey; reduced_image.h says how. Throws Error naming the file when it is
/// missing, empty, truncated (a JPEG by more than a quarter of its rows) or no image.
GreyImage LoadGrey(const std::filesystem::path& file);

/// The same from the bytes of a file, `name` for messages.
GreyImage DecodeGrey(const std::vector<uint8_t>& bytes, const std::string& name);

}  // namespace deepuav
