#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "deepuav/image/image.h"

namespace deepuav {

/// As LoadGrey, reduced to `size` where that is not empty: a JPEG as far as the format can while it
/// is decoded. More than 8 bits a pixel, where they span little of their range (thermal cameras),
/// are stretched until all but the darkest and brightest hundredth fills it. A JPEG that breaks off
/// is used as far as it goes if three quarters of its rows are there, and a warning logged.
GreyImage LoadReducedGrey(const std::filesystem::path& file, const cv::Size& size);

/// As LoadReducedGrey, in colour: blue, green, red. Of a JPEG that breaks off, the rows that are
/// lost are cut off.
cv::Mat3b LoadReducedColour(const std::filesystem::path& file, const cv::Size& size);

/// The same as LoadReducedGrey from the bytes of a file, `name` for messages.
GreyImage DecodeReducedGrey(const std::vector<uint8_t>& bytes, const std::string& name,
                            const cv::Size& size);

}  // namespace deepuav
