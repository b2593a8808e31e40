#include "deepuav/survey/pairs/near_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace deepuav {
namespace {

constexpr size_t kSides = 6;
/// Over the distance of the nearest `count`, on whichever side they are: further away is another
/// place, or a fix that is wrong.
constexpr double kFarthest = 5;

struct Neighbour {
  double distance_m = 0;
  int apart = 0;  ///< In the order of the views, which tells views at one place apart.
  int view = 0;
  size_t side = 0;

  auto operator<=>(const Neighbour&) const = default;
};

size_t SideOf(const Eigen::Vector2d& offset) {
  const double turns = std::atan2(offset.y(), offset.x()) / (2 * std::numbers::pi) + 0.5;
  return std::min(kSides - 1, static_cast<size_t>(kSides * turns));
}

/// The nearest of each side, then the second of each, as long as there are any.
std::vector<int> OnAllSides(std::vector<Neighbour> all, size_t count) {
  if (all.empty() || count == 0) return {};
  std::sort(all.begin(), all.end());
  const double farthest_m = kFarthest * all[std::min(count, all.size()) - 1].distance_m;
  std::array<int, kSides> of_side{};
  std::vector<std::pair<int, int>> by_rank;  // rank on its side, place among all
  for (size_t i = 0; i < all.size() && all[i].distance_m <= farthest_m; ++i)
    by_rank.emplace_back(of_side[all[i].side]++, static_cast<int>(i));
  std::sort(by_rank.begin(), by_rank.end());
  std::vector<int> views;
  for (size_t i = 0; i < by_rank.size() && i < count; ++i)
    views.push_back(all[static_cast<size_t>(by_rank[i].second)].view);
  return views;
}

}  // namespace

std::vector<std::set<int>> NearViews(const std::vector<std::optional<Eigen::Vector3d>>& positions_m,
                                     int count, int in_order) {
  std::vector<std::set<int>> near(positions_m.size());
  const auto views = static_cast<int>(positions_m.size());
  for (int a = 0; a < views; ++a) {
    const auto& here = positions_m[static_cast<size_t>(a)];
    if (!here) continue;
    std::vector<Neighbour> all;
    for (int b = 0; b < views; ++b) {
      const auto& there = positions_m[static_cast<size_t>(b)];
      const int apart = std::abs(a - b);
      if (!there || apart <= in_order) continue;
      const Eigen::Vector2d offset = (*there - *here).head<2>();
      all.push_back({offset.norm(), apart, b, SideOf(offset)});
    }
    for (const int b : OnAllSides(std::move(all), static_cast<size_t>(count))) {
      near[static_cast<size_t>(a)].insert(b);
      near[static_cast<size_t>(b)].insert(a);
    }
  }
  return near;
}

}  // namespace deepuav
