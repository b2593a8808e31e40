#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/base/time.h"

namespace deepuav {

/// A sample of a track: what it holds and when, from the track's start.
struct Mp4Sample {
  Timestamp start;
  double duration_s = 0;
  std::string bytes;
};

/// The samples of the first track of an MP4 file (ISO/IEC 14496-12) whose sample entry is `format`,
/// four characters. Empty for a file that is no MP4, has no such track, or whose tables contradict
/// one another; a sample that lies outside of the file is left out, and so is one of more than
/// 16 MiB. Throws Error where the file cannot be read.
std::vector<Mp4Sample> ReadMp4Track(const std::filesystem::path& file, std::string_view format);

}  // namespace deepuav
