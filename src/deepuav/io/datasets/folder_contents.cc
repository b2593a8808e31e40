#include "deepuav/io/datasets/folder_contents.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <string_view>

#include "deepuav/io/geodata/table_row.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kVideoEndings[] = {".mp4", ".mov", ".m4v",  ".avi", ".mkv",
                                              ".mpg", ".ts",  ".webm", ".mpeg"};
constexpr std::string_view kForeignEndings[] = {".heic", ".heif", ".avif", ".gif", ".jp2", ".j2k",
                                                ".jxl",  ".dng",  ".cr2",  ".cr3", ".nef", ".arw",
                                                ".raf",  ".orf",  ".rw2",  ".pef", ".srw", ".raw"};

template <size_t kCount>
bool EndsWithAny(const fs::path& file, const std::string_view (&endings)[kCount]) {
  return std::ranges::find(endings, LowerCase(file.extension().string())) != std::end(endings);
}

bool IsHidden(const fs::path& file) { return file.filename().string().starts_with('.'); }

/// Stricter than what tells the layout of a folder that is named: photographs may lie in a folder
/// of any name.
bool IsSequence(const fs::path& folder) {
  const fs::path kitti = folder / "image_0";
  return fs::is_directory(folder / "mav0/cam0") || fs::is_regular_file(folder / "cam0/data.csv") ||
         fs::is_regular_file(folder / "rgb.txt") ||
         (fs::is_directory(kitti) &&
          (fs::is_regular_file(folder / "times.txt") || fs::is_regular_file(folder / "calib.txt")));
}

void SortByName(std::vector<std::string>* names) {
  std::ranges::sort(*names, [](const std::string& a, const std::string& b) {
    return ::strverscmp(a.c_str(), b.c_str()) < 0;
  });
}

fs::recursive_directory_iterator Below(const fs::path& folder) {
  return fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied);
}

}  // namespace

bool IsVideoFileName(const fs::path& file) { return EndsWithAny(file, kVideoEndings); }

std::vector<std::string> SequencesBelow(const fs::path& folder) {
  constexpr int kDeepest = 2;  // As in KITTI's sequences/00; deeper ones would take long to find.
  std::vector<std::string> found;
  for (auto entry = Below(folder); entry != end(entry); ++entry) {
    std::error_code unreadable;  // then it is no folder to look into
    if (!entry->is_directory(unreadable) || IsHidden(entry->path())) {
      entry.disable_recursion_pending();
      continue;
    }
    const bool is_sequence = IsSequence(entry->path());
    if (is_sequence) found.push_back(entry->path().lexically_relative(folder).string());
    if (is_sequence || entry.depth() == kDeepest) entry.disable_recursion_pending();
  }
  SortByName(&found);
  return found;
}

std::vector<std::string> VideosIn(const fs::path& folder) {
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (IsVideoFileName(entry.path()) && !IsHidden(entry.path()))
      found.push_back(entry.path().filename().string());
  }
  SortByName(&found);
  return found;
}

std::string ForeignImagesBelow(const fs::path& folder) {
  std::map<std::string, std::vector<std::string>> by_ending;
  for (const auto& entry : Below(folder)) {
    const fs::path& file = entry.path();
    if (EndsWithAny(file, kForeignEndings) && !IsHidden(file))
      by_ending[LowerCase(file.extension().string())].push_back(file.filename().string());
  }
  std::string text;
  for (auto& [ending, names] : by_ending) {
    SortByName(&names);
    text += fmt::format("{}{} {} ({}{})", text.empty() ? "" : ", ", names.size(), ending,
                        names.front(), names.size() > 1 ? ", ..." : "");
  }
  return text;
}

std::string SomeOf(const std::vector<std::string>& names) {
  constexpr size_t kMostNamed = 5;
  const std::vector<std::string> named(
      names.begin(), names.begin() + static_cast<int64_t>(std::min(names.size(), kMostNamed)));
  const size_t more = names.size() - named.size();
  return fmt::format("{}{}", fmt::join(named, ", "),
                     more == 0 ? "" : fmt::format(" and {} more", more));
}

}  // namespace deepuav
