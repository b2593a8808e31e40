#include "deepuav/evaluation/drawing/trajectory_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "deepuav/evaluation/drawing/svg.h"
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
