#include "work/training_images.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "MANIFEST.tsv";
constexpr std::string_view kFileColumn = "file", kSourceColumn = "source_repo";

bool IsImageName(const fs::path& file) {
  static const std::set<std::string> kExtensions = {".jpg", ".jpeg", ".png", ".tif", ".tiff"};
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return kExtensions.contains(extension);
}

std::vector<std::string> SplitAtTabs(std::string_view text) {
  std::vector<std::string> fields;
  while (true) {
    const size_t tab = text.find('\t');
    fields.emplace_back(text.substr(0, tab));
    if (tab == std::string_view::npos) return fields;
    text.remove_prefix(tab + 1);
  }
}

size_t ColumnOf(const std::vector<std::string>& header, std::string_view name,
                const fs::path& file) {
  const auto found = std::find(header.begin(), header.end(), name);
  if (found == header.end())
    throw Error("{}: the first line names no column '{}'", file.string(), name);
  return static_cast<size_t>(found - header.begin());
}

/// Sources by file name; empty where there is no manifest.
std::map<std::string, std::string> ReadManifest(const fs::path& folder) {
  std::map<std::string, std::string> sources;
  const fs::path file = folder / kManifest;
  if (!fs::exists(file)) return sources;
  const TextFile text(file);
  if (text.lines().empty()) throw Error("{}: is empty", file.string());
  const std::vector<std::string> header = SplitAtTabs(text.lines().front().text);
  const size_t name = ColumnOf(header, kFileColumn, file);
  const size_t source = ColumnOf(header, kSourceColumn, file);
  for (size_t i = 1; i < text.lines().size(); ++i) {
    const std::vector<std::string> fields = SplitAtTabs(text.lines()[i].text);
    if (fields.size() <= std::max(name, source)) {
      throw Error("{}: has {} columns: expected {} as in the first line",
                  text.Where(text.lines()[i]), fields.size(), header.size());
    }
    sources[fields[name]] = fields[source];
  }
  return sources;
}

/// How many images each source gives so that all together give at most `max_images`: the same
/// number where they can, the first ones one more where that leaves a rest.
std::vector<size_t> ShareEvenly(const ImagesBySource& images, int max_images) {
  std::vector<size_t> counts(images.size());
  auto left = static_cast<size_t>(max_images);
  for (bool gave = true; gave;) {
    gave = false;
    size_t* count = counts.data();
    for (const auto& [source, files] : images) {
      if (left > 0 && *count < files.size()) {
        ++*count;
        --left;
        gave = true;
      }
      ++count;
    }
  }
  return counts;
}

}  // namespace

ImagesBySource FindImages(const fs::path& folder, const std::vector<std::string>& excluded) {
  const std::map<std::string, std::string> sources = ReadManifest(folder);
  std::set<fs::path> excluded_folders;
  for (const std::string& name : excluded) {
    if (!fs::is_directory(folder / name))
      throw Error("--exclude {}: {} has no such folder", name, folder.string());
    excluded_folders.insert((folder / name).lexically_normal());
  }
  ImagesBySource images;
  try {
    for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::end(entry); ++entry) {
      if (entry->is_directory() && excluded_folders.contains(entry->path().lexically_normal())) {
        entry.disable_recursion_pending();
      }
      if (!entry->is_regular_file() || !IsImageName(entry->path())) continue;
      const fs::path name = entry->path().lexically_relative(folder);
      const auto source = sources.find(name.generic_string());
      images[source == sources.end() ? name.parent_path().generic_string() : source->second]
          .push_back(entry->path());
    }
  } catch (const fs::filesystem_error& error) {
    throw Error("{}: cannot be read: {}", folder.string(), error.code().message());
  }
  if (images.empty()) throw Error("{}: holds no image", folder.string());
  for (auto& [source, files] : images) std::sort(files.begin(), files.end());
  return images;
}

std::vector<fs::path> SampleEvenly(const ImagesBySource& images, int max_images) {
  const std::vector<size_t> counts = ShareEvenly(images, max_images);
  std::vector<fs::path> sample;
  const size_t* count = counts.data();
  for (const auto& [source, files] : images) {
    for (size_t i = 0; i < *count; ++i) sample.push_back(files[i * files.size() / *count]);
    ++count;
  }
  return sample;
}

}  // namespace deepuav
