#include "deepuav/survey/pairs/near_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "support/synthetic_world.h"

namespace deepuav {
namespace {

using Positions = std::vector<std::optional<Eigen::Vector3d>>;

/// Lines along x, `spacing_m` from view to view and 30 m apart.
Positions Lines(int in_line, int lines, double spacing_m, double sigma_m, Random* random) {
  Positions positions_m;
  for (int line = 0; line < lines; ++line) {
    for (int i = 0; i < in_line; ++i)
      positions_m.emplace_back(Eigen::Vector3d(spacing_m * i, 30.0 * line, 60 + i % 3) +
                               sigma_m * RandomDirection(random));
  }
  return positions_m;
}

TEST(NearViews, NeighbouringLinesAreAmongThem) {
  Random random(1);
  constexpr int kInLine = 21, kMiddle = kInLine + kInLine / 2;
  for (const double spacing_m : {3.0, 10.0, 30.0}) {
    const std::set<int> of_middle =
        NearViews(Lines(kInLine, 3, spacing_m, 0.3, &random), 12, 3)[kMiddle];
    for (const int line : {kMiddle - kInLine, kMiddle + kInLine}) {
      const auto beside =
          std::ranges::count_if(of_middle, [line](int view) { return std::abs(view - line) <= 3; });
      EXPECT_GE(beside, 1) << spacing_m << ", line of " << line;
    }
    for (int apart = -3; apart <= 3; ++apart)
      EXPECT_FALSE(of_middle.contains(kMiddle + apart)) << "a neighbour in order anyway";
    EXPECT_LE(of_middle.size(), 24u);
  }
}

TEST(NearViews, AreAllOfOneLineWhereThereIsNoOther) {
  Random random(2);
  const std::vector<std::set<int>> near = NearViews(Lines(100, 1, 10, 0.3, &random), 12);
  for (const int view : near[50]) EXPECT_LE(std::abs(view - 50), 7);
  EXPECT_GE(near[50].size(), 12u);
}

TEST(NearViews, OfTwoEitherIsNearTheOther) {
  const Positions positions_m = {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0),
                                 Eigen::Vector3d(1.5, 0, 0), Eigen::Vector3d(9, 0, 0)};
  const std::vector<std::set<int>> near = NearViews(positions_m, 1);
  EXPECT_EQ(near[0], std::set<int>{1});
  EXPECT_EQ(near[1], (std::set<int>{0, 2}));
  EXPECT_EQ(near[2], (std::set<int>{1, 3})) << "the only one that is near the last";
  EXPECT_EQ(near[3], std::set<int>{2});
}

TEST(NearViews, AnotherPlaceIsNotNear) {
  Random random(3);
  Positions positions_m = Lines(10, 2, 10, 0.3, &random);
  const int here = static_cast<int>(positions_m.size());
  for (const auto& position_m : Lines(10, 2, 10, 0.3, &random))
    positions_m.emplace_back(*position_m + Eigen::Vector3d(5000, 0, 0));
  const std::vector<std::set<int>> near = NearViews(positions_m, 12);
  for (int view = 0; view < here; ++view)
    EXPECT_LT(*near[static_cast<size_t>(view)].rbegin(), here);
}

TEST(NearViews, AtOnePlaceAreThoseNextInOrder) {
  const Positions positions_m(40, Eigen::Vector3d(1, 2, 3));
  const std::vector<std::set<int>> near = NearViews(positions_m, 12);
  for (int view = 0; view < 40; ++view) {
    const std::set<int>& of_view = near[static_cast<size_t>(view)];
    EXPECT_LE(of_view.size(), 24u);
    EXPECT_TRUE(of_view.contains(view == 0 ? 1 : view - 1)) << view;
  }
}

TEST(NearViews, ViewsWithoutAPositionAreNearNone) {
  const Positions positions_m = {Eigen::Vector3d(0, 0, 0), std::nullopt, Eigen::Vector3d(0, 0, 0)};
  const std::vector<std::set<int>> near = NearViews(positions_m, 5);
  EXPECT_EQ(near[0], std::set<int>{2}) << "at the very same place";
  EXPECT_TRUE(near[1].empty());
  EXPECT_TRUE(NearViews(positions_m, 0)[0].empty());
}

}  // namespace
}  // namespace deepuav
