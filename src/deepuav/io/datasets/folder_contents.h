#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace deepuav {

/// Whether the name ends as a video's does (mp4, mov, ...; either case).
bool IsVideoFileName(const std::filesystem::path& file);

/// The sub-folders, some levels down, that are datasets of a layout of their own: EuRoC, TUM or
/// KITTI. By name, relative to `folder`. May throw filesystem_error.
std::vector<std::string> SequencesBelow(const std::filesystem::path& folder);

/// The videos in the folder itself, by name. May throw filesystem_error.
std::vector<std::string> VideosIn(const std::filesystem::path& folder);

/// The images in and below the folder whose format is not read, by format: "12 .heic (IMG_1.HEIC,
/// ...), 1 .gif (a.gif)". Empty where there are none. May throw filesystem_error.
std::string ForeignImagesBelow(const std::filesystem::path& folder);

/// The first names, and how many more there are.
std::string SomeOf(const std::vector<std::string>& names);

}  // namespace deepuav
