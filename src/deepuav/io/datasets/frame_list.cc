#include "deepuav/io/datasets/frame_list.h"

#include <algorithm>
#include <cctype>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

std::filesystem::path ListedImage(const std::filesystem::path& folder, std::string_view name,
                                  const std::string& where) {
  const bool has_control =
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return std::iscntrl(c) != 0; });
  if (name.empty() || has_control) {
    throw Error("{}: file name is {}: expected the name of an image", where, Quoted(name));
  }
  return folder / std::filesystem::path(name);
}

}  // namespace

void CheckGrows(const std::vector<ImageFileFrame>& frames, Timestamp time,
                const std::string& where) {
  if (frames.empty() || frames.back().time < time) return;
  throw Error(
      "{}: time stamp {} ns does not come after the one before, {} ns: expected growing times",
      where, time.nanoseconds, frames.back().time.nanoseconds);
}

std::vector<ImageFileFrame> ReadFrameList(const std::filesystem::path& list,
                                          const std::filesystem::path& images,
                                          const FrameListFormat& format) {
  const TextFile text(list);
  std::vector<ImageFileFrame> frames;
  frames.reserve(text.lines().size());
  std::vector<std::string_view> fields;
  for (const TextLine& line : text.lines()) {
    const std::string where = text.Where(line);
    format.split(line.text, &fields);
    if (fields.size() != 2) {
      throw Error("{}: {} fields in {}: expected '{}'", where, fields.size(), Quoted(line.text),
                  format.line);
    }
    const Timestamp time = format.parse_time(fields[0], where);
    CheckGrows(frames, time, where);
    frames.push_back({time, ListedImage(images, fields[1], where)});
  }
  if (frames.empty())
    throw Error("{}: lists no frame: expected '{}' lines", list.string(), format.line);
  return frames;
}

}  // namespace deepuav
