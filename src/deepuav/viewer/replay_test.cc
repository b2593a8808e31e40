#include "deepuav/viewer/replay.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "deepuav/viewer/view_test_support.h"
#include "support/map_builder.h"

namespace deepuav {
namespace {

constexpr const char* kSummary = R"({"version": "1", "main_map": 0, "dataset": {"path": "flight"},
  "closed_loops": 1, "merged_maps": 2, "peak_resident_mb": 321.5})";
constexpr const char* kFrames =
    "frame,time_ns,state,map,key_points,landmarks,keyframe,reason\n"
    "0,1000000000,located,0,4,4,0,\n"
    "1,1100000000,located,0,4,4,1,\n"
    "2,1200000000,located,0,4,4,2,\n";
constexpr const char* kTrajectory =
    "1.000000000 0 0 0 0 0 0 1\n1.100000000 1 0 0 0 0 0 1\n1.200000000 2 0 0 0 0 0 1\n";

/// A map in metres, in which a loop was closed.
Atlas MetricAtlas() {
  constexpr int kKeypoints = 4;
  MapBuilder builder(1, kKeypoints);
  std::vector<KeyframeId> ids;
  for (int i = 0; i < 3; ++i) {
    ids.push_back(builder.AddKeyframe());
    if (i > 0) builder.map.ConnectToParent(ids.back(), ids.front());
  }
  for (int i = 0; i < kKeypoints; ++i) builder.AddLandmark(ids, i);
  builder.map.AddLoop(ids[0], ids[2]);
  Atlas atlas;
  atlas.ids() = builder.ids;
  atlas.Add(std::move(builder.map));
  atlas.ChangeGauge(MapId{0}, Sim3(), {GaugeKind::kMetric, {}, 0.01});
  return atlas;
}

class ReplayTest : public testing::Test {
 protected:
  ReplayTest() {
    std::filesystem::create_directory(folder_);
    Camera camera;
    camera.width = 640;
    camera.height = 480;
    camera.pinhole = {500, 500, 320, 240};
    WriteMapFile(folder_ / "map.deepuav", MetricAtlas(), camera, {});
    Write("summary.json", kSummary);
    Write("frames.csv", kFrames);
    Write("trajectory.txt", kTrajectory);
  }
  ~ReplayTest() override { std::filesystem::remove_all(folder_); }

  void Write(const char* name, const char* text) { std::ofstream(folder_ / name) << text; }

  /// What is shown at the end, by its kind.
  std::map<std::string, nlohmann::json> ShownAtItsEnd() {
    ViewModel model("flight");
    model.CountWatchers(+1);
    ViewCursor cursor;
    std::map<std::string, nlohmann::json> shown;
    const auto is_over = [&] {
      model.Refresh(true);
      while (const auto message = model.Next(&cursor)) {
        const nlohmann::json json = JsonOf(*message);
        shown[json["kind"]] = json;
      }
      const auto events = shown.find("events");
      return events != shown.end() && events->second["lines"].back() == "the replay ends";
    };
    Replay(folder_, {100, 1, 3}, &model).Run(is_over);
    return shown;
  }

  const std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                        ("deepuav_replay_test_" + std::to_string(::getpid()));
};

TEST_F(ReplayTest, ShowsWhatTheRunRecordedOfItself) {
  const auto status = ShownAtItsEnd().at("status");
  EXPECT_EQ(status["frame"], 2);
  EXPECT_EQ(status["closed_loops"], 1);
  EXPECT_EQ(status["merged_maps"], 2);
  EXPECT_EQ(status["memory_mb"], 321.5);
  EXPECT_EQ(status["memory_is_peak"], true);
}

TEST_F(ReplayTest, ShowsTheMapTheRightWayUpWithItsLoops) {
  const auto map = ShownAtItsEnd().at("map");
  EXPECT_EQ(map["up"], (nlohmann::json{0, 0, 1}));
  EXPECT_EQ(map["keyframes"], 3);
  EXPECT_EQ(map["loops"], 1);
}

TEST_F(ReplayTest, ShowsNothingOfWhatTheSummaryDoesNotSay) {
  Write("summary.json", R"({"version": "1", "main_map": 0, "dataset": {"path": "flight"},
                                    "closed_loops": "many"})");
  const auto status = ShownAtItsEnd().at("status");
  EXPECT_EQ(status["closed_loops"], 0);
  EXPECT_EQ(status["memory_mb"], 0);
}

}  // namespace
}  // namespace deepuav
