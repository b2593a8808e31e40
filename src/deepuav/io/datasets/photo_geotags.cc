#include "deepuav/io/datasets/photo_geotags.h"

#include <algorithm>
#include <map>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/geodata/fix_table.h"
#include "deepuav/io/geodata/geotag_file.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

/// A photograph's index by each of its names; -1 where several have it.
using IndexByName = std::map<std::string, int>;

std::string Key(const fs::path& name) { return LowerCase(name.generic_string()); }

IndexByName NamesOf(const fs::path& images, const std::vector<fs::path>& photographs) {
  IndexByName index;
  for (size_t i = 0; i < photographs.size(); ++i) {
    const fs::path& file = photographs[i];
    for (const fs::path& name : {file.lexically_relative(images), file.filename(), file.stem()}) {
      const auto [place, is_new] = index.emplace(Key(name), static_cast<int>(i));
      if (!is_new && place->second != static_cast<int>(i)) place->second = -1;
    }
  }
  return index;
}

/// Tables may have paths of another machine, with slashes of either kind.
std::optional<size_t> Find(const IndexByName& index, std::string image) {
  std::ranges::replace(image, '\\', '/');
  const fs::path name(image);
  for (const fs::path& candidate : {name, name.filename(), name.stem()}) {
    const auto found = index.find(Key(candidate));
    if (found != index.end() && found->second >= 0) return static_cast<size_t>(found->second);
  }
  return std::nullopt;
}

}  // namespace

PhotoGeotags FindPhotoGeotags(const std::vector<fs::path>& folders, const fs::path& images,
                              const std::vector<fs::path>& photographs) {
  PhotoGeotags geotags;
  geotags.fixes.resize(photographs.size());
  try {
    const fs::path file = FindGeotagsBeside(folders);
    if (file.empty()) return geotags;
    const IndexByName index = NamesOf(images, photographs);
    for (const Geotag& tag : ReadGeotagFile(file)) {
      const std::optional<size_t> place = Find(index, tag.image);
      if (!place) continue;
      geotags.fixes[*place] = tag.fix;
      geotags.file = file;
    }
    if (geotags.file.empty())
      Log().warn("{}: not used: it names none of the photographs", file.string());
  } catch (const Error& error) {
    Log().warn("not used: {}", error.what());
    geotags = {.file = {}, .fixes = std::vector<std::optional<GnssFix>>(photographs.size())};
  }
  return geotags;
}

}  // namespace deepuav
