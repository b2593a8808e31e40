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

struct Match {
  size_t photograph = 0;
  int rank = 0;  ///< 0: by path, 1: by name, 2: by name without ending.
};

/// Tables may have paths of another machine, with slashes of either kind.
std::optional<Match> Find(const IndexByName& index, std::string image) {
  std::ranges::replace(image, '\\', '/');
  const fs::path name(image);
  int rank = 0;
  for (const fs::path& candidate : {name, name.filename(), name.stem()}) {
    const auto found = index.find(Key(candidate));
    if (found != index.end() && found->second >= 0)
      return Match{static_cast<size_t>(found->second), rank};
    ++rank;
  }
  return std::nullopt;
}

/// The positions of the photographs that a table names. A row that names one better, by its path,
/// leads; where two name it equally well it has none, as they may mean another in another folder.
std::vector<std::optional<GnssFix>> FixesByName(const std::vector<Geotag>& tags,
                                                const IndexByName& index, size_t count) {
  constexpr int kWorst = 3;
  std::vector<std::optional<GnssFix>> fixes(count);
  std::vector<int> ranks(count, kWorst);
  for (const Geotag& tag : tags) {
    const std::optional<Match> match = Find(index, tag.image);
    if (!match || match->rank > ranks[match->photograph]) continue;
    const bool is_twice = match->rank == ranks[match->photograph];
    ranks[match->photograph] = match->rank;
    fixes[match->photograph] = is_twice ? std::nullopt : std::optional(tag.fix);
  }
  return fixes;
}

}  // namespace

PhotoGeotags FindPhotoGeotags(const std::vector<fs::path>& folders, const fs::path& images,
                              const std::vector<fs::path>& photographs) {
  const IndexByName index = NamesOf(images, photographs);
  for (const fs::path& file : FindGeotagsBeside(folders)) {
    try {
      auto fixes = FixesByName(ReadGeotagFile(file), index, photographs.size());
      if (std::ranges::any_of(fixes, [](const auto& fix) { return fix.has_value(); }))
        return {file, std::move(fixes)};
      Log().warn("{}: not used: it names none of the photographs", file.string());
    } catch (const Error& error) {
      Log().warn("not used: {}", error.what());
    }
  }
  return {{}, std::vector<std::optional<GnssFix>>(photographs.size())};
}

}  // namespace deepuav
