#include "deepuav/evaluation/trajectory_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "deepuav/evaluation/plot_axes.h"
#include "support/flights.h"

namespace deepuav {
namespace {

/// Whether every element is closed in order, as a parser of XML asks.
bool IsBalanced(const std::string& xml) {
  std::vector<std::string> open;
  for (size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const size_t end = xml.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag[0] == '?' || tag[0] == '!' || tag.back() == '/') continue;
    const std::string name = tag.substr(tag[0] == '/' ? 1 : 0, tag.find_first_of(" \n"));
    if (tag[0] != '/') {
      open.push_back(name);
    } else if (open.empty() || open.back() != name) {
      return false;
    } else {
      open.pop_back();
    }
  }
  return open.empty();
}

TEST(Ticks, AreRoundAndInside) {
  for (const double extent : {1e-6, 0.013, 1.0, 47.0, 9e5}) {
    for (const double low : {0.0, -0.3 * extent, 17 * extent}) {
      const PlotRange range{low, low + extent};
      const std::vector<double> ticks = Ticks(range, 6);
      ASSERT_GE(ticks.size(), 2u);
      ASSERT_LE(ticks.size(), 6u);
      EXPECT_GE(ticks.front(), range.low - 1e-9 * extent);
      EXPECT_LE(ticks.back(), range.high + 1e-9 * extent);
      EXPECT_EQ(TickLabels(ticks).size(), ticks.size());
      EXPECT_NE(TickLabels(ticks).front(), TickLabels(ticks).back());
    }
  }
}

TEST(Ticks, ASingleValueStillHasARange) { EXPECT_GT(RangeOf({3, 3, 3}, 0.05).Extent(), 0); }

TEST(Ticks, EndWhereValuesDifferByRoundingAlone) {
  for (const double value : {1.5, -100.3, 430.7, 1e17}) {
    std::vector<double> values{value, value};
    for (int ulps = 0; ulps < 5; ++ulps) {
      const PlotRange range = RangeOf(values, 0.05);
      EXPECT_LT(range.low, range.high);
      const std::vector<double> ticks = Ticks(range, 6);
      EXPECT_LE(ticks.size(), 7u);
      EXPECT_GE(ticks.size(), 1u);
      values.push_back(std::nextafter(values.back(), 2 * std::abs(value)));
    }
  }
}

TEST(PlotAxes, MapsTheCornersOfTheRange) {
  const PlotAxes axes({{10, 20}, {100, 50}}, {0, 1}, {-2, 2});
  EXPECT_LT((axes.Pixel(0, 2) - Eigen::Vector2d(10, 20)).norm(), 1e-9);
  EXPECT_LT((axes.Pixel(1, -2) - Eigen::Vector2d(110, 70)).norm(), 1e-9);
}

TEST(TrajectoryPlot, IsWellFormedAndTheSameEachTime) {
  const Truth truth{MakeFlight(300, 20), true};
  Random random(5);
  const EvaluationOptions options;
  const Evaluation evaluation =
      EvaluateTrajectory(truth, AddNoise(truth.trajectory, 0.05, random), options);
  const std::string svg = PlotTrajectories(evaluation, options);
  EXPECT_EQ(svg, PlotTrajectories(evaluation, options));
  EXPECT_TRUE(IsBalanced(svg));
  EXPECT_THAT(svg, testing::HasSubstr("<svg"));
  EXPECT_THAT(svg, testing::HasSubstr("polyline"));
  EXPECT_THAT(svg, testing::HasSubstr("truth"));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(TrajectoryPlot, PlanShowsTheTwoLongestAxes) {
  Trajectory along_x_and_z;
  for (int i = 0; i < 20; ++i) {
    along_x_and_z.push_back(
        {AtSeconds(i), SE3(Eigen::Quaterniond::Identity(), {1.0 * i, 0.01 * i, 0.5 * (i % 5)})});
  }
  EXPECT_THAT(PlanAxes(along_x_and_z, false), testing::ElementsAre(0, 2));
}

TEST(TrajectoryPlot, PlanOfAClimbIsSeenFromAboveWhereUpIsKnown) {
  Trajectory climb;
  for (int i = 0; i < 20; ++i) {
    climb.push_back(
        {AtSeconds(i), SE3(Eigen::Quaterniond::Identity(), {0.2 * (i % 3), 0.1 * i, 10.0 * i})});
  }
  EXPECT_THAT(PlanAxes(climb, true), testing::ElementsAre(0, 1));
}

TEST(Svg, EscapesText) { EXPECT_EQ(EscapeXml("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;"); }

}  // namespace
}  // namespace deepuav
