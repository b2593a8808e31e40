#include "deepuav/evaluation/report/run_report.h"

#include "deepuav/evaluation/drawing/packed_array.h"
#include "deepuav/evaluation/report/evaluation_report.h"
#include "deepuav/evaluation/testing/run_files.h"
#include "deepuav/io/maps/map_file.h"
#include "support/map_builder.h"

namespace deepuav {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr int kManyPoints = 1000;

class RunReportTest : public RunFiles {
 protected:
  /// The run's poses, and its truth: the same moved, larger and `later_s` later.
  void WriteFlight(int poses, double later_s = 0) {
    WriteTrajectory(run_ / "trajectory.txt", MakeFlight(poses, 10));
    WriteTrajectory(root_ / "truth.txt", MoveTrajectory(moved_, MakeFlight(poses, 10, later_s)));
  }
  RunReport Compared(const EvaluationOptions& options = {}) const {
    RunReport report = Report();
    Evaluate(root_ / "truth.txt", options, {}, &report);
    return report;
  }
  /// A map of three keyframes of the run, the first two of which show one landmark.
  void WriteMap() const {
    MapBuilder builder(1, 2);
    for (int i = 0; i < 3; ++i) builder.AddKeyframe();
    builder.map.UpdateAppearance(builder.AddLandmark({{0}, {1}}, 0));
    builder.map.ConnectToParent({1}, {0});
    builder.map.ConnectToParent({2}, {1});
    Atlas atlas;
    atlas.Add(std::move(builder.map));
    atlas.ids() = builder.ids;
    Camera camera;
    camera.width = 64;
    camera.height = 48;
    camera.pinhole = {50, 50, 31.5, 23.5};
    WriteMapFile(run_ / "map.deepuav", atlas, camera, {"1", "f", "m", {}});
  }

  const Sim3 moved_{3, RotationExp({0.4, -0.3, 1.1}), {3, 2, -1}};
};

TEST_F(RunReportTest, OfARunWithoutPosesIsWholeAndSaysWhy) {
  Write(run_ / "trajectory.txt", "");
  WriteFlight(10);
  Write(run_ / "trajectory.txt", "");
  const RunReport report = Compared();
  EXPECT_FALSE(report.evaluation);
  EXPECT_THAT(report.problem, HasSubstr("no poses"));
  EXPECT_EQ(report.Start(), Timestamp{});
  const nlohmann::ordered_json json = RunReportJson(report, kManyPoints);
  EXPECT_TRUE(json["evaluation"].is_null());
  EXPECT_EQ(json["path"]["t"], PackFloats({}));
  EXPECT_EQ(json["cloud"]["count"], 0);
}

TEST_F(RunReportTest, OfOneFrameIsWholeAndItsTruthRefused) {
  WriteFlight(1);
  EXPECT_THROW(Compared(), Error);
  EvaluationOptions as_is;
  as_is.alignment.reset();
  const RunReport report = Compared(as_is);
  ASSERT_TRUE(report.evaluation);
  EXPECT_FALSE(report.evaluation->rpe);
  const nlohmann::ordered_json json = RunReportJson(report, kManyPoints);
  EXPECT_TRUE(json["evaluation"]["relative"].is_null());
  EXPECT_EQ(json["evaluation"]["error_m"],
            PackFloats({static_cast<float>(report.evaluation->ate.errors_m.front())}));
}

TEST_F(RunReportTest, MovesPathKeyframesAndCloudIntoTheTruthsWorld) {
  WriteFlight(60);
  const Trajectory flight = ReadTrajectory(run_ / "trajectory.txt");
  WriteTrajectory(run_ / "keyframes.txt", {flight[0], flight[30]});
  const Eigen::Vector3d place(1, -2, 0.5);
  WritePly(run_ / "points.ply", std::vector{ColouredPoint::Grey(place, 9)});
  const RunReport report = Compared();
  const nlohmann::ordered_json json = RunReportJson(report, kManyPoints);
  const auto floats = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    std::vector<float> numbers;
    for (const Eigen::Vector3d& point : {a, b})
      for (const double value : point) numbers.push_back(static_cast<float>(value));
    return numbers;
  };
  const Sim3 found = report.WorldFromMap();
  EXPECT_NEAR(found.scale(), 3, 1e-6);
  EXPECT_EQ(json["keyframes"]["p"],
            PackFloats(floats(found * flight[0].world_from_cam.translation(),
                              found * flight[30].world_from_cam.translation())));
  const Eigen::Vector3f low(json["cloud"]["low"][0], json["cloud"]["low"][1],
                            json["cloud"]["low"][2]);
  EXPECT_LT((low.cast<double>() - moved_ * place).norm(), 1e-5);
}

TEST_F(RunReportTest, TellsTimeOnTheTruthsClock) {
  constexpr size_t kLate = 5;  // Poses of the truth before the run's first.
  WriteFlight(80, 2);
  Trajectory flight = ReadTrajectory(run_ / "trajectory.txt");
  flight.erase(flight.begin(), flight.begin() + kLate);
  WriteTrajectory(run_ / "trajectory.txt", flight);
  EvaluationOptions options;
  options.association.time_offset_s = 2;
  const nlohmann::ordered_json json = RunReportJson(Compared(options), kManyPoints);
  std::vector<float> seconds;
  for (int i = 0; i < 80; ++i) seconds.push_back(static_cast<float>(0.1 * i));
  EXPECT_EQ(json["evaluation"]["truth"]["t"], PackFloats(seconds));
  seconds.erase(seconds.begin(), seconds.begin() + kLate);
  EXPECT_EQ(json["path"]["t"], PackFloats(seconds));
  EXPECT_EQ(json["evaluation"]["matched"]["t"], PackFloats(seconds));
}

TEST_F(RunReportTest, ThinsACloudEvenlyAndDownToNothing) {
  std::vector<ColouredPoint> points;
  for (int i = 0; i < 10; ++i) points.push_back({{i * 1.0, 0, 0}, {uint8_t(i), 0, 0}});
  WritePly(run_ / "points.ply", points);
  const RunReport report = Report();
  const nlohmann::ordered_json some = RunReportJson(report, 5);
  EXPECT_EQ(some["cloud"]["rgb"], PackBytes({0, 0, 0, 2, 0, 0, 4, 0, 0, 6, 0, 0, 8, 0, 0}));
  EXPECT_EQ(RunReportJson(report, 0)["cloud"]["count"], 0);
  EXPECT_EQ(RunReportJson(report, 11)["cloud"]["count"], 10);
}

TEST_F(RunReportTest, SaysWhyADatasetGivesNoTruth) {
  const std::filesystem::path dataset = root_ / "dataset";
  const auto problem = [&](const std::filesystem::path& path) {
    Write(run_ / "summary.json",
          nlohmann::json{{"version", "1"}, {"main_map", 0}, {"dataset", {{"path", path.string()}}}}
              .dump());
    RunReport report = Report();
    Evaluate({}, {}, {}, &report);
    EXPECT_FALSE(report.evaluation);
    return report.problem;
  };
  EXPECT_THAT(problem(""), HasSubstr("no longer there"));
  EXPECT_THAT(problem(dataset), HasSubstr("no longer there"));
  std::filesystem::create_directories(dataset);
  EXPECT_THAT(problem(dataset), HasSubstr("dataset"));
  Write(root_ / "flight.mp4", "video");
  EXPECT_THAT(problem(root_ / "flight.mp4"), HasSubstr("video"));
}

TEST_F(RunReportTest, ATruthOfAnotherTimeIsAnErrorOnlyWhereItWasNamed) {
  WriteFlight(20, 500);
  EXPECT_THAT([&] { Compared(); }, Refuses("500.000"));
}

TEST_F(RunReportTest, ShowsTheMapThatIsThere) {
  WriteMap();
  RunReport report = Report();
  AddMap({}, &report);
  EXPECT_THAT(report.growth.landmarks, testing::ElementsAre(0, 1, 1));
  ASSERT_THAT(report.pictures, SizeIs(2));
  EXPECT_EQ(report.pictures[0]["shared"], 1);
  EXPECT_TRUE(report.survey.is_null());
}

TEST_F(RunReportTest, DoesWithoutAMapThatIsMissingDamagedOrAnother) {
  const auto expect_none = [&](const char* what) {
    RunReport report = Report();
    AddMap({}, &report);
    EXPECT_THAT(report.growth.times, IsEmpty()) << what;
    EXPECT_THAT(report.pictures, IsEmpty()) << what;
  };
  expect_none("missing");
  WriteMap();
  for (const char* main_map : {"-1", "7", "18446744073709551615"}) {
    Write(run_ / "summary.json", fmt::format(R"({{"version": "1", "main_map": {},)"
                                             R"( "dataset": {{"path": ""}}}})",
                                             main_map));
    expect_none(main_map);
  }
  WriteLeast(run_);
  std::filesystem::resize_file(run_ / "map.deepuav",
                               std::filesystem::file_size(run_ / "map.deepuav") / 2);
  expect_none("cut");
  Write(run_ / "map.deepuav", "no map");
  expect_none("no map");
  WriteMap();
  Write(run_ / "trajectory.txt", "");
  expect_none("no poses");
}

TEST_F(RunReportTest, CountsLostFramesAndStagesAsTheFolderDoes) {
  Write(run_ / "frames.csv",
        "header\n3,3,lost,,0,0,,\"7 inliers\"\n4,4,lost,,0,0,,\"8 inliers\"\n");
  Write(run_ / "timings.csv", "stage,call,milliseconds\ntrack,0,1.5\n");
  const nlohmann::ordered_json json = RunReportJson(Report(), kManyPoints);
  EXPECT_EQ(json["lost"].dump(), R"([{"reason":"N inliers","frames":2,"first":3,"last":4}])");
  ASSERT_THAT(json["stages"], SizeIs(1));
  EXPECT_EQ(json["stages"][0]["ms"], PackFloats({1.5f}));
}

}  // namespace
}  // namespace deepuav
