#pragma once

#include <filesystem>
#include <vector>

#include "deepuav/assembly/networks/pair_matcher.h"

namespace deepuav {

/// Writes a PNG of the two images side by side, reduced to `max_side_px` each where they are
/// larger, with a line for every match: red at `lowest_score`, over yellow to green at 1. Throws
/// Error naming a file that cannot be read or written.
void WriteMatchPicture(const std::filesystem::path& file, const std::filesystem::path& image_a,
                       const std::filesystem::path& image_b, const std::vector<PixelMatch>& matches,
                       int max_side_px, double lowest_score);

}  // namespace deepuav
