#include "deepuav/evaluation/report/run_folder.h"

#include <cstring>
#include <limits>

#include "deepuav/evaluation/testing/run_files.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class RunFolderTest : public RunFiles {
 protected:
  void ExpectRefusal(const char* file, const char* part) const {
    EXPECT_THAT([&] { ReadRunFolder(run_); }, Refuses(file, part));
  }
};

TEST_F(RunFolderTest, OfTheLeastThereIsNothingElse) {
  const RunFolder run = ReadRunFolder(run_);
  EXPECT_EQ(run.trajectory.size(), 10u);
  EXPECT_THAT(run.keyframes, IsEmpty());
  EXPECT_THAT(run.stage_ms, IsEmpty());
  EXPECT_THAT(run.points, IsEmpty());
  EXPECT_THAT(run.lost, IsEmpty());
}

TEST_F(RunFolderTest, WithoutAMapHasNoPoses) {
  for (const char* poses : {"", "# time x y z qx qy qz qw\n", "\n \r\n"}) {
    Write(run_ / "trajectory.txt", poses);
    Write(run_ / "keyframes.txt", poses);
    const RunFolder run = ReadRunFolder(run_);
    EXPECT_THAT(run.trajectory, IsEmpty());
    EXPECT_THAT(run.keyframes, IsEmpty());
  }
}

TEST_F(RunFolderTest, NeedsSummaryAndTrajectory) {
  for (const char* needed : {"summary.json", "trajectory.txt"}) {
    std::filesystem::remove(run_ / needed);
    ExpectRefusal(needed, "");
    WriteLeast(run_);
  }
  EXPECT_THAT([&] { ReadRunFolder(run_ / "summary.json"); }, Refuses("is no folder"));
}

struct Damage {
  const char *file, *text, *part;
};

TEST_F(RunFolderTest, DamagedFilesAreRefusedByFileAndLine) {
  const Damage damages[] = {
      {"summary.json", "[]", "is no JSON object"},
      {"summary.json", "", "is no JSON"},
      {"summary.json", R"({"version": 1, "main_map": 0, "dataset": {"path": ""}})",
       "version is '1'"},
      {"summary.json", R"({"version": "1", "main_map": 0.5, "dataset": {"path": ""}})",
       "main_map is '0.5'"},
      {"summary.json", R"({"version": "1", "main_map": 0, "dataset": []})", "dataset is '[]'"},
      {"summary.json", R"({"version": "1", "main_map": 0, "dataset": {}})", "has no dataset/path"},
      {"summary.json",
       R"({"version": "1", "main_map": 0, "dataset": {"path": ""}, "maps": [{"id": 0}, {"id": "x"}]})",
       "maps/*/id is"},
      {"trajectory.txt", "0 1 2 3 0 0 0\n", "trajectory.txt:1"},
      {"trajectory.txt", "0 nan 2 3 0 0 0 1\n", "trajectory.txt:1"},
      {"trajectory.txt", "1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", "trajectory.txt:2"},
      {"keyframes.txt", "0 1 2 3 0 0 0 0\n", "keyframes.txt:1"},
      {"timings.csv", "stage,call,milliseconds\ntrack,0\n", "timings.csv:2: 2 fields"},
      {"timings.csv", "stage,call,milliseconds\ntrack,0,1\ntrack,1,inf\n", "timings.csv:3"},
      {"timings.csv", "stage,call,milliseconds\ntrack,0,\n", "milliseconds"},
      {"frames.csv", "frame\n0,0,lost\n", "frames.csv:2: 3 fields"},
      {"frames.csv", "frame\nx,0,lost,,0,0,,\n", "the frame's number"},
      {"frames.csv", "frame\n1e300,0,lost,,0,0,,\n", "the frame's number"},
      {"frames.csv", "frame\n1.5,0,lost,,0,0,,\n", "the frame's number"},
      {"frames.csv", "frame\n-3,0,lost,,0,0,,\n", "the frame's number"},
      {"points.ply", "ply\n", "another header"}};
  for (const Damage& damage : damages) {
    SCOPED_TRACE(damage.text);
    Write(run_ / damage.file, damage.text);
    ExpectRefusal(damage.file, damage.part);
    std::filesystem::remove(run_ / damage.file);
    WriteLeast(run_);
  }
}

TEST_F(RunFolderTest, ASummaryNestedWithoutEndIsRefused) {
  constexpr size_t kDepth = 200'000;
  const std::string nested = std::string(kDepth, '[') + std::string(kDepth, ']');
  Write(run_ / "summary.json",
        R"({"version": )" + nested + R"(, "main_map": 0, "dataset": {"path": ""}})");
  ExpectRefusal("summary.json", "nested");
}

TEST_F(RunFolderTest, ACloudThatIsCutOrNotFiniteIsRefused) {
  const ColouredPoint point = ColouredPoint::Grey({1, 2, 3}, 90);
  WritePly(run_ / "points.ply", std::vector<ColouredPoint>(3, point));
  ASSERT_EQ(ReadRunFolder(run_).points.size(), 3u);
  const auto size = std::filesystem::file_size(run_ / "points.ply");
  std::string bytes(size, 0);
  std::ifstream(run_ / "points.ply", std::ios::binary)
      .read(bytes.data(), static_cast<std::streamsize>(size));
  Write(run_ / "points.ply", std::string_view(bytes).substr(0, size - 1));
  ExpectRefusal("points.ply", "length");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(bytes.data() + size - 15, &nan, sizeof(nan));
  Write(run_ / "points.ply", bytes);
  ExpectRefusal("points.ply", "finite");
}

TEST_F(RunFolderTest, StagesComeInTheFilesOrderPastBlankLinesAndNotes) {
  Write(run_ / "timings.csv",
        "stage,call,milliseconds\r\nmap,0,4\r\nmap,1,5\r\ntrack,0,1\n\n# note\n track , 1, 2\n");
  const RunFolder run = ReadRunFolder(run_);
  ASSERT_EQ(run.stage_ms.size(), 2u);
  EXPECT_EQ(run.stage_ms[0].first, "map");
  EXPECT_THAT(run.stage_ms[0].second, ElementsAre(4, 5));
  EXPECT_EQ(run.stage_ms[1].first, "track");
  EXPECT_THAT(run.stage_ms[1].second, ElementsAre(1, 2));
}

TEST_F(RunFolderTest, ReasonsOfLostFramesMayHoldCommasAndNumbers) {
  Write(run_ / "frames.csv",
        "frame,time_ns,state,map,key_points,landmarks,keyframe,reason\n"
        "0,0,lost,,9,0,,\"9 key points, 2.5 px off\"\n"
        "1,1,tracked,0,9,0,,\"9 key points, 2.5 px off\"\n"
        "5,5,lost,,8,0,,\"12 key points, 13.75 px off\"\n"
        "6,6,lost,,8,0,,\"out of sight\"\n");
  const std::vector<LostFrames> lost = ReadRunFolder(run_).lost;
  ASSERT_EQ(lost.size(), 2u);
  EXPECT_EQ(lost[0].reason, "N key points, N.N px off");
  EXPECT_EQ(lost[0].count, 2);
  EXPECT_EQ(lost[0].last, 5);
  EXPECT_EQ(lost[1].reason, "out of sight");
}

TEST_F(RunFolderTest, NamesTellApartAsFarAsPathsDo) {
  std::vector<RunFolder> runs;
  for (const char* place : {"x/a/run", "y/a/run", "run", "y/b/other"}) {
    WriteLeast(root_ / place);
    runs.push_back(ReadRunFolder(root_ / place));
  }
  MakeNamesUnique(&runs);
  EXPECT_EQ(runs[0].name, "x/a/run");
  EXPECT_EQ(runs[1].name, "y/a/run");
  EXPECT_EQ(runs[2].name, root_.filename().string() + "/run");
  EXPECT_EQ(runs[3].name, "other");

  // Twice the same folder cannot be told apart: it ends all the same.
  runs = {ReadRunFolder(run_), ReadRunFolder(run_ / ".." / "run")};
  MakeNamesUnique(&runs);
  EXPECT_EQ(runs[0].name, runs[1].name);
}

TEST_F(RunFolderTest, TextIsOfAnyFieldAndNothingWhereThereIsNone) {
  Write(run_ / "summary.json", Summary(R"(, "wall_s": 2.5, "maps": [{"id": 3}])"));
  const RunFolder run = ReadRunFolder(run_);
  EXPECT_EQ(run.Text("/wall_s"), "2.5");
  EXPECT_EQ(run.Text("/maps/0/id"), "3");
  EXPECT_EQ(run.Text("/maps/7/id"), "");
  EXPECT_EQ(run.Text("/version/path"), "");
}

}  // namespace
}  // namespace deepuav
