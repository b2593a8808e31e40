#include "deepuav/evaluation/drawing/report_plots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "support/flights.h"

namespace deepuav {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::Pair;

/// A run whose estimate errs by `error_m` along x at the middle of its flight.
RunReport RunOf(const std::string& name, double error_m, int poses = 40) {
  const Truth truth{MakeFlight(poses, 10), true};
  Trajectory estimate = truth.trajectory;
  SE3& middle = estimate[static_cast<size_t>(poses / 2)].world_from_cam;
  middle = SE3(middle.rotation(), middle.translation() + Eigen::Vector3d(error_m, 0, 0));
  RunReport report;
  report.run.name = name;
  report.run.trajectory = estimate;
  report.options.alignment.reset();
  report.evaluation = EvaluateTrajectory(truth, estimate, report.options);
  return report;
}

std::vector<std::string> NamesOf(const std::vector<std::pair<std::string, std::string>>& plots) {
  std::vector<std::string> names;
  for (const auto& [name, svg] : plots) names.push_back(name);
  return names;
}

std::string PlotNamed(const std::string& wanted, const std::vector<RunReport>& reports) {
  for (const auto& [name, svg] : ReportPlots(reports)) {
    if (name == wanted) return svg;
  }
  return "";
}

std::set<std::string> ColoursOfLines(const std::string& svg) {
  std::set<std::string> colours;
  const std::regex line("<line[^>]*stroke=\"(#[0-9a-f]+)\"[^>]*stroke-width=\"2.4\"");
  for (auto at = std::sregex_iterator(svg.begin(), svg.end(), line); at != std::sregex_iterator();
       ++at)
    colours.insert((*at)[1]);
  return colours;
}

TEST(ReportPlots, OfNothingAreNone) {
  EXPECT_THAT(ReportPlots({}), IsEmpty());
  RunReport empty;
  empty.run.stage_ms = {{"track", {}}};
  EXPECT_THAT(ReportPlots({empty, empty}), IsEmpty());
}

TEST(ReportPlots, ARunWithoutTruthLeavesTheOthersTheirs) {
  RunReport without;
  without.run.name = "without";
  without.run.trajectory = MakeFlight(5, 10);
  const auto plots = ReportPlots({without, RunOf("with", 1)});
  EXPECT_THAT(NamesOf(plots), ElementsAre("with-trajectory.svg", "with-error.svg", "errors.svg"));
  EXPECT_THAT(plots, Each(Pair(testing::_, Not(HasSubstr("nan")))));
}

TEST(ReportPlots, AFlightWithoutErrorOrOfOnePoseHasPlotsOfNumbers) {
  RunReport one = RunOf("one", 0.5, 1);
  for (const auto& [name, svg] : ReportPlots({RunOf("exact", 0), one})) {
    EXPECT_THAT(svg, Not(HasSubstr("nan"))) << name;
    EXPECT_THAT(svg, Not(HasSubstr("inf"))) << name;
  }
}

TEST(ReportPlots, ColourThePathByItsError) {
  // Where all errs the same, all has the colour of the largest error, and else both ends appear.
  const std::string exact = PlotNamed("run-error.svg", {RunOf("run", 0)});
  EXPECT_THAT(ColoursOfLines(exact), ElementsAre("#2dc0a0"));
  EXPECT_THAT(ColoursOfLines(PlotNamed("run-error.svg", {RunOf("run", 5, 400)})),
              ElementsAre("#2dc0a0", "#b3154a"));
}

TEST(ReportPlots, NameNoTwoFilesAlike) {
  std::vector<RunReport> reports = {RunOf("a/run", 1), RunOf("a-run", 1), RunOf("a/run", 1)};
  const std::vector<std::string> names = NamesOf(ReportPlots(reports));
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  for (const std::string& name : names) EXPECT_THAT(name, Not(HasSubstr("/")));
  EXPECT_THAT(names, testing::Contains("a-run-error.svg"));
}

TEST(ReportPlots, NamesOfRunsAreText) {
  EXPECT_THAT(PlotNamed("errors.svg", {RunOf("<a&b>", 1)}), HasSubstr("&lt;a&amp;b&gt;"));
}

TEST(ReportPlots, BarsAreAsLongAsTheMediansOfTheirStages) {
  RunReport fast, slow;
  fast.run.stage_ms = {{"track", {1, 2, 90}}, {"map", {}}};
  slow.run.stage_ms = {{"track", {8, 8}}};
  const std::string svg = PlotNamed("timings.svg", {fast, slow});
  std::vector<double> widths;
  const std::regex bar("<rect[^>]* width=\"([0-9.]+)\" height=\"14.00\"");
  for (auto at = std::sregex_iterator(svg.begin(), svg.end(), bar); at != std::sregex_iterator();
       ++at)
    widths.push_back(std::stod((*at)[1]));
  // The stages by name: map, then track, each of the fast and the slow run.
  ASSERT_EQ(widths.size(), 4u);
  EXPECT_EQ(widths[0], 0);
  EXPECT_EQ(widths[1], 0);
  EXPECT_NEAR(widths[2] / widths[3], 0.25, 1e-3);
}

TEST(ReportPlots, GrowthIsOverTheTruthsTime) {
  RunReport report;
  report.run.trajectory = MakeFlight(3, 1, 100);
  report.growth = {{AtSeconds(100), AtSeconds(104)}, {7, 12}};
  const std::string svg = PlotNamed("growth.svg", {report});
  EXPECT_THAT(svg, HasSubstr("landmarks"));
  EXPECT_THAT(svg, HasSubstr(">4.0</text>"));
  EXPECT_THAT(svg, Not(HasSubstr(">104")));
}

}  // namespace
}  // namespace deepuav
