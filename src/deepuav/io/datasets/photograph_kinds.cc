#include "deepuav/io/datasets/photograph_kinds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

/// What photographs of one lens have in common.
struct Kind {
  int width = 0, height = 0;
  std::string model, band;
  double focal_mm = 0;  ///< The shortest of those that count as one; 0 where none is said.

  auto operator<=>(const Kind&) const = default;
};

using Kinds = std::vector<std::optional<Kind>>;

/// The key with the highest count, the first of several.
template <typename Key>
Key MostCommon(const std::map<Key, int>& counts) {
  return std::max_element(counts.begin(), counts.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

/// Gives those without a camera's name the one that most of their size have.
void NameCameras(Kinds* kinds) {
  std::map<std::pair<int, int>, std::map<std::string, int>> named;
  for (const auto& kind : *kinds) {
    if (kind && !kind->model.empty()) ++named[{kind->width, kind->height}][kind->model];
  }
  for (auto& kind : *kinds) {
    if (!kind || !kind->model.empty()) continue;
    const auto of_size = named.find({kind->width, kind->height});
    if (of_size != named.end()) kind->model = MostCommon(of_size->second);
  }
}

/// Focal lengths with less than a step of zoom between them count as one, photographs that say none
/// as those of the most common.
void GatherZooms(Kinds* kinds) {
  constexpr double kZoomStep = 1.2;
  std::map<Kind, std::map<double, int>> zooms;  // By kind without it.
  const auto of_any_zoom = [](Kind kind) {
    kind.focal_mm = 0;
    return kind;
  };
  for (const auto& kind : *kinds) {
    if (kind && kind->focal_mm > 0) ++zooms[of_any_zoom(*kind)][kind->focal_mm];
  }
  struct Gathered {
    std::map<double, double> shortest;
    double most_common = 0;
  };
  std::map<Kind, Gathered> gathered;
  for (const auto& [any_zoom, counts] : zooms) {
    Gathered& of_kind = gathered[any_zoom];
    std::map<double, int> sums;
    double last = 0;
    for (const auto& [focal_mm, count] : counts) {
      const bool is_new = focal_mm > kZoomStep * last;
      of_kind.shortest[focal_mm] = is_new ? focal_mm : of_kind.shortest.at(last);
      sums[of_kind.shortest.at(focal_mm)] += count;
      last = focal_mm;
    }
    of_kind.most_common = MostCommon(sums);
  }
  for (auto& kind : *kinds) {
    if (!kind) continue;
    const auto of_kind = gathered.find(of_any_zoom(*kind));
    if (of_kind == gathered.end()) continue;
    const Gathered& all = of_kind->second;
    kind->focal_mm = kind->focal_mm > 0 ? all.shortest.at(kind->focal_mm) : all.most_common;
  }
}

/// By photograph; nothing for those that cannot be read.
Kinds KindsOf(const std::vector<Photograph>& photographs) {
  Kinds kinds;
  for (const Photograph& photograph : photographs) {
    std::optional<Kind>& kind = kinds.emplace_back();
    if (!photograph.size) continue;
    kind = {photograph.size->width, photograph.size->height, photograph.exif.camera_model,
            photograph.band, photograph.exif.focal_length_mm.value_or(0)};
  }
  NameCameras(&kinds);
  GatherZooms(&kinds);
  return kinds;
}

struct FoundKind {
  int count = 0;
  std::optional<double> focal_over_side;  ///< By the first photograph that says it.
};

/// Less is better, of kinds that are about as many.
auto Rank(const Kind& kind, double focal_over_side) {
  // Plants are brightest in green, next to infrared, where soil, water and roofs are poor.
  const int band = kind.band.empty() ? 0 : kind.band == "Green" ? 1 : kind.band == "Red" ? 2 : 3;
  return std::tuple(band, focal_over_side, -int64_t{kind.width} * kind.height);
}

Kind BestKind(const Kinds& kinds, const std::vector<Photograph>& photographs) {
  constexpr double kAboutAsMany = 0.9;
  std::map<Kind, FoundKind> found;
  int most = 0;
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (!kinds[i]) continue;
    FoundKind& of_kind = found[*kinds[i]];
    most = std::max(most, ++of_kind.count);
    const auto focal_px = FocalLengthPx(photographs[i].exif, kinds[i]->width, kinds[i]->height);
    if (focal_px && !of_kind.focal_over_side)
      of_kind.focal_over_side = *focal_px / std::max(kinds[i]->width, kinds[i]->height);
  }
  std::erase_if(found, [&](const auto& kind) { return kind.second.count < kAboutAsMany * most; });
  // Views are compared where all are known.
  const bool compares = std::ranges::all_of(
      found, [](const auto& kind) { return kind.second.focal_over_side.has_value(); });
  const auto rank = [&](const auto& kind) {
    return Rank(kind.first, compares ? *kind.second.focal_over_side : 0);
  };
  return std::ranges::min_element(found, std::less(), rank)->first;
}

std::string Described(const Kind& kind) {
  std::string text = fmt::format("{}x{}", kind.width, kind.height);
  if (!kind.model.empty()) text += " by " + kind.model;
  if (kind.focal_mm > 0) text += fmt::format(", {:g} mm", kind.focal_mm);
  if (!kind.band.empty()) text += ", " + kind.band;
  return text;
}

}  // namespace

void KeepOneKind(std::vector<Photograph>* photographs) {
  const Kinds kinds = KindsOf(*photographs);
  std::map<Kind, std::vector<std::string>> names;
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i]) names[*kinds[i]].push_back((*photographs)[i].file.filename().string());
  }
  if (names.size() < 2) return;
  const Kind best = BestKind(kinds, *photographs);
  for (const auto& [kind, files] : names) {
    if (kind == best) continue;
    Log().warn("left out, {} photographs that are {} where {} are {}: {}", files.size(),
               Described(kind), names.at(best).size(), Described(best), fmt::join(files, ", "));
  }
  std::vector<Photograph> kept;
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (!kinds[i] || *kinds[i] == best) kept.push_back(std::move((*photographs)[i]));
  }
  *photographs = std::move(kept);
}

}  // namespace deepuav
