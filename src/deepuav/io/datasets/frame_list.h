#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "deepuav/io/datasets/image_file_dataset.h"

namespace deepuav {

/// How a list of frames writes one: its time and the name of its image, in two fields.
struct FrameListFormat {
  const char* line;  ///< As messages call it.
  void (*split)(std::string_view line, std::vector<std::string_view>* fields);
  Timestamp (*parse_time)(std::string_view field, const std::string& where);
};

/// The frames of `list`, whose images lie in `images`. Throws Error naming file and line for one
/// that is not as `format` says, names no file or does not come after the one before; and for a
/// list without any.
std::vector<ImageFileFrame> ReadFrameList(const std::filesystem::path& list,
                                          const std::filesystem::path& images,
                                          const FrameListFormat& format);

/// Throws Error unless `time` is later than that of the last frame; `where` is "file:line".
void CheckGrows(const std::vector<ImageFileFrame>& frames, Timestamp time,
                const std::string& where);

}  // namespace deepuav
