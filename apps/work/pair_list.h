#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace deepuav {

/// Two images to match.
struct ImagePair {
  std::filesystem::path a, b;
  std::string where;  ///< "file:line" of the list; empty for a pair of the command line.
};

/// The first two columns of every line, parted by blanks; blank lines and those that begin with '#'
/// are left out. Relative paths are taken from `folder`. Throws Error naming file and line for a
/// line with one column and for an image that is not there, and for a list without a pair.
std::vector<ImagePair> ReadPairList(const std::filesystem::path& file,
                                    const std::filesystem::path& folder);

}  // namespace deepuav
