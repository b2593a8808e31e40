#include <set>
#include <sstream>

#include "deepuav/evaluation/report/run_folder.h"
#include "deepuav/evaluation/testing/run_files.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

class RunFolderFuzzTest : public RunFiles {
 protected:
  static std::string BytesOf(const std::filesystem::path& file) {
    std::ostringstream bytes;
    bytes << std::ifstream(file, std::ios::binary).rdbuf();
    return bytes.str();
  }
  std::string Points() const {
    const std::filesystem::path file = root_ / "seed.ply";
    WritePly(file, std::vector(2, ColouredPoint::Grey({1, 2, 3}, 77)));
    return BytesOf(file);
  }
};

/// The first line names the file.
TEST_F(RunFolderFuzzTest, AnyOfItsFiles) {
  const std::vector<std::string> seeds = {
      "summary.json\n" + Summary(R"(, "wall_s": 3.5, "frames": {"located": 9, "lost": 1},
 "maps": [{"id": 0, "frames": 9, "keyframes": 3, "landmarks": 70, "gauge": {}}],
 "stages": {"track": {"median_ms": 7.5}}, "options": {"features": {"keypoints": "1000"}})"),
      "trajectory.txt\n1 0 0 0 0 0 0 1\n2.5 1e-3 -2 3 0.6 0 0 0.8\n",
      "keyframes.txt\n# time x y z\n1 0 0 0 0 0 0 1\n",
      "timings.csv\nstage,call,ms\ntrack,0,7.5\ntrack,1,8\ndecode,0,1e-2\n",
      "frames.csv\nframe,time_ns,state,map,key_points,landmarks,keyframe,reason\n"
      "0,15,located,0,9,8,0,\n1,16,lost,0,9,8,,\"3 of 20, too few\"\n",
      "points.ply\n" + Points()};
  const std::set<std::string> names = {"summary.json", "trajectory.txt", "keyframes.txt",
                                       "timings.csv",  "frames.csv",     "points.ply"};
  // Folders that go, files written twice or as the program does would wait for the disk.
  const std::string trajectory = BytesOf(run_ / "trajectory.txt");
  Fuzz(seeds, 4000, [&](const std::string& input) {
    const std::string first_line = input.substr(0, input.find('\n'));
    const bool is_named = names.contains(first_line);
    const std::string name = is_named ? first_line : "summary.json";
    for (const std::string& file : names) std::filesystem::remove(run_ / file);
    if (name != "summary.json") Write(run_ / "summary.json", Summary(""));
    if (name != "trajectory.txt") Write(run_ / "trajectory.txt", trajectory);
    Write(run_ / name, is_named
                           ? std::string_view(input).substr(std::min(name.size() + 1, input.size()))
                           : std::string_view(input));
    for (const TimedPose& pose : ReadRunFolder(run_).trajectory)
      EXPECT_TRUE(pose.world_from_cam.Matrix().allFinite());
  });
}

}  // namespace
}  // namespace deepuav
