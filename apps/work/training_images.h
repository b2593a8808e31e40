#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace deepuav {

/// Image files by the source that they come from, in order of their names.
using ImagesBySource = std::map<std::string, std::vector<std::filesystem::path>>;

/// All images in and below a folder, but those below its subfolders `excluded`. The source of one
/// is what the column source_repo of the folder's MANIFEST.tsv says for its file, else the folder
/// that it lies in. Throws Error naming the folder when it cannot be read or holds no image, and a
/// manifest without the columns file and source_repo.
ImagesBySource FindImages(const std::filesystem::path& folder,
                          const std::vector<std::string>& excluded);

/// At most `max_images`, as evenly from the sources as these allow, and evenly within each.
std::vector<std::filesystem::path> SampleEvenly(const ImagesBySource& images, int max_images);

}  // namespace deepuav
