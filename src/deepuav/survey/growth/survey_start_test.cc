#include "deepuav/survey/growth/survey_start.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

constexpr double kWidthPx = 1000;

/// Pairs of photographs of one row of key points each, those of each further to the right than in
/// the one before.
struct ShiftedRows {
  explicit ShiftedRows(const std::vector<double>& shifts_px) {
    constexpr int kKeypoints = 100;
    double shift_px = 0;
    for (const double further_px : shifts_px) {
      shift_px += further_px;
      std::vector<SightPixel>& of_view = px.emplace_back();
      for (int i = 0; i < kKeypoints; ++i) of_view.push_back({Eigen::Vector2d(shift_px, i)});
    }
  }

  void Match(int a, int b, int matches) {
    MatchedPair& pair = pairs.emplace_back(MatchedPair{a, b, {}});
    for (int i = 0; i < matches; ++i) pair.matches.push_back({i, i, 1});
  }

  std::vector<std::pair<int, int>> Ranked(const std::set<int>& taken = {}) const {
    std::vector<std::pair<int, int>> ranked;
    for (const MatchedPair* pair : RankStartPairs(pairs, px, taken, kWidthPx))
      ranked.emplace_back(pair->a, pair->b);
    return ranked;
  }

  ViewPixels px;
  std::vector<MatchedPair> pairs;
};

using Pairs = std::vector<std::pair<int, int>>;

TEST(RankStartPairs, ManyMatchesThatMovedComeBeforeMoreThatDidNot) {
  ShiftedRows rows({0, 2, 250, 0, 700});
  rows.Match(0, 1, 100);  // hardly moved
  rows.Match(1, 2, 60);
  rows.Match(2, 3, 100);  // not at all
  rows.Match(0, 4, 50);   // moved farther, which is no better
  rows.Match(0, 3, 0);
  const Pairs ranked = rows.Ranked();
  ASSERT_EQ(ranked.size(), 5u);
  EXPECT_EQ((Pairs{ranked.begin(), ranked.begin() + 3}), (Pairs{{1, 2}, {0, 4}, {0, 1}}));
}

TEST(RankStartPairs, AFewWrongMatchesAreNoMotion) {
  ShiftedRows rows({0, 2, 100});
  rows.Match(0, 1, 100);
  rows.Match(1, 2, 90);
  for (size_t i = 0; i < 20; ++i) rows.px[0][i].px.x() += 900;
  EXPECT_EQ(rows.Ranked(), (Pairs{{1, 2}, {0, 1}}));
}

TEST(RankStartPairs, PhotographsOfOtherMapsStartNone) {
  ShiftedRows rows({0, 100, 100, 100});
  rows.Match(0, 1, 100);
  rows.Match(1, 2, 90);
  rows.Match(2, 3, 80);
  EXPECT_EQ(rows.Ranked({1}), (Pairs{{2, 3}}));
  EXPECT_TRUE(rows.Ranked({1, 2}).empty());
}

}  // namespace
}  // namespace deepuav
