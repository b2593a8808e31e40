#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "deepuav/base/error.h"
#include "deepuav/evaluation/drawing/packed_array.h"
#include "deepuav/evaluation/drawing/report_plots.h"
#include "deepuav/evaluation/page_files.h"
#include "deepuav/evaluation/report/report_page.h"
#include "support/flights.h"

namespace deepuav {
namespace {

using testing::HasSubstr;
using testing::Not;

const Sim3 kMoved(0.2, RotationExp({0.4, -0.3, 1.1}), {3, 2, -1});

/// A folder as a run leaves it, and the truth of its flight.
class ReportTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("deepuav_report_test_") +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    WriteRun(folder_ / "a" / "run", 1);
    WriteTrajectory(folder_ / "truth.txt", MakeFlight(200, 20));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static void WriteRun(const std::filesystem::path& out, uint64_t seed) {
    std::filesystem::create_directories(out);
    Random random(seed);
    const Trajectory flight = MoveTrajectory(kMoved, AddNoise(MakeFlight(200, 20), 0.05, random));
    WriteTrajectory(out / "trajectory.txt", flight);
    WriteTrajectory(out / "keyframes.txt", {flight[0], flight[100]});
    std::vector<ColouredPoint> points;
    for (int i = 0; i < 100; ++i) {
      points.push_back(ColouredPoint::Grey(
          {random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)}, 180));
    }
    WritePly(out / "points.ply", points);
    std::ofstream(out / "timings.csv") << "stage,call,milliseconds\ntrack,0,1.5\ntrack,1,2.5\n";
    std::ofstream(out / "summary.json")
        << R"({"version": "1", "main_map": 0, "dataset": {"path": "/gone</script>"},)"
        << R"( "options": {"a.b": "1"}})";
  }

  RunReport Compared(const std::filesystem::path& out) const {
    RunReport report;
    report.run = ReadRunFolder(out);
    Evaluate(folder_ / "truth.txt", {}, {}, &report);
    AddMap({}, &report);
    return report;
  }

  std::filesystem::path folder_;
};

TEST_F(ReportTest, ReadsARunsFolder) {
  const RunFolder run = ReadRunFolder(folder_ / "a" / "run" / "");
  EXPECT_EQ(run.name, "run");
  EXPECT_EQ(run.trajectory.size(), 200u);
  EXPECT_EQ(run.points.size(), 100u);
  ASSERT_EQ(run.stage_ms.size(), 1u);
  EXPECT_EQ(run.stage_ms[0].second, (std::vector<double>{1.5, 2.5}));
  EXPECT_EQ(run.Text("/options/a.b"), "1");
  EXPECT_EQ(run.Text("/absent"), "");
}

TEST_F(ReportTest, WrongFoldersAreErrorsThatNameTheFile) {
  EXPECT_THROW(ReadRunFolder(folder_ / "absent"), Error);
  std::ofstream(folder_ / "a/run/summary.json") << "{";
  EXPECT_THAT([&] { ReadRunFolder(folder_ / "a/run"); },
              testing::Throws<Error>(testing::Property(&Error::what, HasSubstr("summary.json"))));
}

TEST_F(ReportTest, WhatIsNoSummaryIsAnErrorThatNamesTheField) {
  const std::string right = R"("version": "1", "main_map": 0, "dataset": {"path": ""})";
  for (const auto& [text, part] : std::vector<std::pair<std::string, std::string>>{
           {"{}", "has no version"},
           {"{", "is no JSON: parse error"},
           {"{" + right + R"(, "maps": {"id": 0}})", "maps is"},
           {"{" + right + R"(, "frames": {"processed": "all"}})", "frames/* is"},
           {"{" + right + R"(, "stages": {"track": 5}})", "stages/* is '5'"}}) {
    std::ofstream(folder_ / "a/run/summary.json") << text;
    EXPECT_THAT([&] { ReadRunFolder(folder_ / "a/run"); },
                testing::Throws<Error>(testing::Property(
                    &Error::what, testing::AllOf(HasSubstr("summary.json"), HasSubstr(part)))));
  }
}

TEST_F(ReportTest, NamesTellRunsApart) {
  WriteRun(folder_ / "b" / "run", 2);
  std::vector<RunFolder> runs = {ReadRunFolder(folder_ / "a/run"),
                                 ReadRunFolder(folder_ / "b/run")};
  MakeNamesUnique(&runs);
  EXPECT_EQ(runs[0].name, "a/run");
  EXPECT_EQ(runs[1].name, "b/run");
}

TEST_F(ReportTest, ComparesWithTheTruth) {
  const RunReport report = Compared(folder_ / "a/run");
  ASSERT_TRUE(report.evaluation.has_value());
  EXPECT_NEAR(report.evaluation->ate.statistics_m.rmse, 0.05 * std::sqrt(3), 0.02);
  const nlohmann::ordered_json json = RunReportJson(report, 30);
  EXPECT_EQ(json["unit"], "m");
  EXPECT_EQ(json["cloud"]["count"], 30);
  EXPECT_EQ(json["cloud"]["total"], 100);
  EXPECT_EQ(json["evaluation"]["figures"]["ate_m"]["rmse"],
            report.evaluation->ate.statistics_m.rmse);
}

TEST_F(ReportTest, CountsLostFramesByTheirReason) {
  std::ofstream(folder_ / "a/run/frames.csv")
      << "frame,time_ns,state,map,key_points,landmarks,keyframe,reason\n"
         "0,0,initialising,,90,0,,\"90 key points, 100 needed\"\n"
         "1,1,tracked,0,500,90,0,\n"
         "2,2,lost,,500,4,,\"4 inliers\"\n"
         "3,3,located,0,500,70,,\"4 inliers\"\n"
         "7,7,lost,,500,14,,\"14 inliers\"\n"
         "9,9,lost,,0,0,,\n";
  const std::vector<LostFrames> lost = ReadRunFolder(folder_ / "a/run").lost;
  ASSERT_EQ(lost.size(), 3u);
  EXPECT_EQ(lost[0].reason, "N inliers");
  EXPECT_EQ(lost[0].count, 2);
  EXPECT_EQ(lost[0].first, 2);
  EXPECT_EQ(lost[0].last, 7);
  EXPECT_EQ(lost[1].reason, "N key points, N needed");
  EXPECT_EQ(lost[2].reason, "no reason was noted");
  std::ofstream(folder_ / "a/run/frames.csv") << "frame\n1,2\n";
  EXPECT_THAT([&] { ReadRunFolder(folder_ / "a/run"); },
              testing::Throws<Error>(testing::Property(&Error::what, HasSubstr("frames.csv:2"))));
}

TEST_F(ReportTest, GreyPointsAreLeftToBeColouredByHeight) {
  std::vector<ColouredPoint> points = {ColouredPoint::Grey({0, 0, 0}, 20),
                                       ColouredPoint::Grey({0, 0, 1}, 200)};
  WritePly(folder_ / "a/run/points.ply", points);
  EXPECT_FALSE(RunReportJson(Compared(folder_ / "a/run"), 30)["cloud"].contains("rgb"));
  points[1].rgb = {200, 20, 20};
  WritePly(folder_ / "a/run/points.ply", points);
  EXPECT_TRUE(RunReportJson(Compared(folder_ / "a/run"), 30)["cloud"].contains("rgb"));
}

TEST_F(ReportTest, TheErrorIsAShareOfThePathThatWasCompared) {
  Trajectory part = ReadTrajectory(folder_ / "a/run/trajectory.txt");
  part.resize(part.size() / 2);
  WriteTrajectory(folder_ / "a/run/trajectory.txt", part);
  const nlohmann::ordered_json json = RunReportJson(Compared(folder_ / "a/run"), 30);
  const nlohmann::ordered_json& figures = json["evaluation"]["figures"];
  const double whole_m = figures["truth_path_m"], part_m = figures["compared_path_m"];
  EXPECT_NEAR(part_m, PathLengthM(MakeFlight(100, 20)), 1e-6);
  EXPECT_GT(whole_m, 1.5 * part_m);
}

TEST_F(ReportTest, WithoutTruthThereIsAReason) {
  RunReport report;
  report.run = ReadRunFolder(folder_ / "a/run");
  Evaluate({}, {}, {}, &report);
  EXPECT_FALSE(report.evaluation.has_value());
  EXPECT_THAT(report.problem, HasSubstr("no longer there"));
  EXPECT_EQ(RunReportJson(report, 10)["unit"], "map units");
  EXPECT_THROW(Evaluate(folder_ / "absent.txt", {}, {}, &report), Error);
}

TEST_F(ReportTest, ThePageIsWholeAndTheSameEachTime) {
  const std::vector<RunReport> reports = {Compared(folder_ / "a/run")};
  const std::string page = ReportPage(reports, "1.2.3");
  EXPECT_EQ(page, ReportPage(reports, "1.2.3"));
  EXPECT_THAT(page, Not(HasSubstr("<!--{")));
  EXPECT_THAT(page, Not(HasSubstr("/gone</script>")));
  EXPECT_THAT(page, HasSubstr("DeepUav.Scene"));
  EXPECT_THAT(page, HasSubstr("Chart.js v3"));
  EXPECT_THAT(page, HasSubstr("Copyright (c) 2010-2019 three.js authors"));
  for (const char* fetching : {"src=\"http", "href=\"http", "@import", "<link rel=\"stylesheet"}) {
    EXPECT_THAT(page, Not(HasSubstr(fetching)));
  }
  EXPECT_THROW(ReportPage({}, "1.2.3"), Error);
  EXPECT_THROW(PageFile("absent.js"), Error);
}

TEST_F(ReportTest, PlotsAreNamedByRunAndNotEmpty) {
  WriteRun(folder_ / "b" / "other", 2);
  const auto plots = ReportPlots({Compared(folder_ / "a/run"), Compared(folder_ / "b/other")});
  std::vector<std::string> names;
  for (const auto& [name, svg] : plots) {
    names.push_back(name);
    EXPECT_THAT(svg, HasSubstr("</svg>")) << name;
    EXPECT_THAT(svg, Not(HasSubstr("nan"))) << name;
  }
  EXPECT_THAT(names,
              testing::ElementsAre("run-trajectory.svg", "run-error.svg", "other-trajectory.svg",
                                   "other-error.svg", "errors.svg", "timings.svg"));
}

Frame FrameAt(double seconds, int keypoints) {
  auto features = std::make_shared<Features>();
  for (int i = 0; i < keypoints; ++i) {
    const Eigen::Vector2f px(10.0f * static_cast<float>(i), 5);
    features->keypoints.push_back({px, px, 1, 1});
  }
  Frame frame;
  frame.time = AtSeconds(seconds);
  frame.features = std::move(features);
  return frame;
}

TEST(KeyframePictures, ShowNeighboursAndWhatTheyShare) {
  Map map({0});
  for (int i = 0; i < 3; ++i) map.AddKeyframe({i}, FrameAt(i, 4), SE3());
  map.AddLandmark({0}, {0, 0, 1}, {1});
  map.AddObservation({0}, 2, {0});
  map.AddObservation({1}, 3, {0});
  map.AddLandmark({1}, {0, 0, 2}, {2});
  map.AddObservation({1}, 0, {1});
  map.AddObservation({2}, 1, {1});
  Camera camera;
  camera.width = 64;
  camera.height = 48;

  const nlohmann::json pictures = KeyframePictures(map, camera, {}, nullptr, {.pairs = 9});
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0]["shared"], 1);
  EXPECT_EQ(pictures[0]["matches"], PackShorts({2, 3}));
  EXPECT_EQ(pictures[1]["matches"], PackShorts({0, 1}));
  EXPECT_EQ(pictures[0]["views"][0]["mapped"], PackBytes({0, 0, 1, 0}));
  EXPECT_FALSE(pictures[0]["views"][0].contains("image"));

  const MapGrowth growth = GrowthOf(map);
  EXPECT_THAT(growth.times, testing::ElementsAre(AtSeconds(0), AtSeconds(1), AtSeconds(2)));
  EXPECT_THAT(growth.landmarks, testing::ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace deepuav
