#include "deepuav/evaluation/measures/truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "deepuav/base/error.h"
#include "support/flights.h"

namespace deepuav {
namespace {

TEST(LoadTruth, TakesAFileOrTheFileInAFolder) {
  const auto folder = std::filesystem::temp_directory_path() / "deepuav_truth_test";
  std::filesystem::create_directories(folder);
  WriteTrajectory(folder / "groundtruth.txt", MakeFlight(10, 10));
  EXPECT_EQ(LoadTruth(folder).trajectory.size(), 10u);
  EXPECT_EQ(LoadTruth(folder / "groundtruth.txt").trajectory.size(), 10u);
  EXPECT_TRUE(LoadTruth(folder).has_orientation);
  std::filesystem::remove_all(folder);
}

TEST(LoadTruth, TheFolderOfSensorsItselfHasTheTruthOfItsDataset) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "deepuav_sensors_truth_test";
  fs::create_directories(folder / "flight/cam0");
  fs::create_directories(folder / "flight/gps0");
  std::ofstream(folder / "flight/gps0/data.csv")
      << "#timestamp [ns],latitude [deg],longitude [deg]\n1,0,0.001\n2,0,0.002\n";
  EXPECT_EQ(LoadTruth(folder / "flight").trajectory.size(), 2u);
  WriteTrajectory(folder / "groundtruth.txt", MakeFlight(10, 10));
  EXPECT_EQ(LoadTruth(folder / "flight").trajectory.size(), 10u) << "beside the folder";
  fs::remove_all(folder);
}

TEST(LoadTruth, RefusesFixesThatJumpAcrossTheEarth) {
  const auto file = std::filesystem::temp_directory_path() / "deepuav_jumping_truth_test.csv";
  std::ofstream(file) << "time,lat,lon\n1,47,8\n2,47,8.0001\n3,-47,172\n";
  try {
    LoadTruth(file);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("at 3000000000 ns lies"), std::string::npos)
        << error.what();
  }
  std::ofstream(file) << "time,lat,lon\n1,47,179.9999\n2,47,-179.9999\n";
  EXPECT_EQ(LoadTruth(file).trajectory.size(), 2u);
  std::filesystem::remove(file);
}

TEST(LoadTruth, KnowsWhereZIsUp) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "deepuav_up_truth_test";
  fs::create_directories(folder / "flight/mav0/cam0");
  fs::create_directories(folder / "tum");
  WriteTrajectory(folder / "flight/groundtruth.txt", MakeFlight(10, 10));
  WriteTrajectory(folder / "tum/groundtruth.txt", MakeFlight(10, 10));
  std::ofstream(folder / "fixes.csv") << "time,lat,lon\n1,0,0.001\n2,0,0.002\n";
  EXPECT_TRUE(LoadTruth(folder / "flight").z_is_up);
  EXPECT_TRUE(LoadTruth(folder / "fixes.csv").z_is_up);
  EXPECT_FALSE(LoadTruth(folder / "tum").z_is_up);
  EXPECT_FALSE(LoadTruth(folder / "flight/groundtruth.txt").z_is_up);
  fs::remove_all(folder);
}

TEST(LoadTruth, KittiPosesTakeTheirTimesFromTimesTxt) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "deepuav_kitti_truth_test";
  fs::create_directories(folder / "poses");
  fs::create_directories(folder / "sequences/00");
  const fs::path poses = folder / "poses/00.txt", estimate = folder / "estimate.txt";
  for (const fs::path& file : {poses, estimate})
    std::ofstream(file) << "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n";
  EXPECT_EQ(LoadTruth(poses).trajectory[1].time, AtSeconds(1));
  std::ofstream(folder / "sequences/00/times.txt") << "0\n0.1\n0.2\n";
  EXPECT_EQ(LoadTruth(poses).trajectory[1].time, AtSeconds(1)) << "not one line a pose";
  std::ofstream(folder / "sequences/00/times.txt") << "0\n0.1\n";
  const Truth truth = LoadTruth(poses);
  EXPECT_EQ(truth.trajectory[1].time, AtSeconds(0.1));
  EXPECT_EQ(LoadEstimate(estimate, truth)[1].time, AtSeconds(0.1));
  EXPECT_EQ(LoadEstimate(estimate, {})[1].time, AtSeconds(1));
  std::ofstream(folder / "poses/times.txt") << "5\n6.5\n";
  EXPECT_EQ(LoadTruth(poses).trajectory[1].time, AtSeconds(6.5)) << "beside the poses";
  fs::remove_all(folder);
}

TEST(LoadEstimate, AGeoreferencedRunIsBroughtToTheTruthsOrigin) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "deepuav_origin_test";
  fs::create_directories(folder / "flight");
  fs::create_directories(folder / "out");
  const GeoPoint simulated{47.4, 8.5, 488}, run{47.401, 8.502, 500};
  const Trajectory flight = MakeFlight(50, 10);
  WriteTrajectory(folder / "flight/groundtruth.txt", flight);
  std::ofstream(folder / "flight/simulation.yaml")
      << "gnss:\n  origin_latitude_deg: 47.4\n  origin_longitude_deg: 8.5\n"
         "  origin_altitude_m: 488\n";
  const Sim3 run_from_simulated(LocalFromLocal(run, simulated));
  const fs::path trajectory = folder / "out/trajectory.txt";
  WriteTrajectory(trajectory, MoveTrajectory(run_from_simulated, flight));
  const Truth truth = LoadTruth(folder / "flight");
  ASSERT_TRUE(truth.origin);
  const auto largest_error = [&] {
    double largest = 0;
    const Trajectory estimate = LoadEstimate(trajectory, truth);
    for (size_t i = 0; i < flight.size(); ++i) {
      largest = std::max(largest, (estimate[i].world_from_cam.translation() -
                                   flight[i].world_from_cam.translation())
                                      .norm());
    }
    return largest;
  };
  EXPECT_GT(largest_error(), 100);
  std::ofstream(folder / "out/summary.json")
      << R"({"main_map": 0, "maps": [{"id": 0, "gauge": {"kind": "georeferenced", "origin": )"
      << R"({"latitude_deg": 47.401, "longitude_deg": 8.502, "altitude_m": 500}}}]})";
  EXPECT_LT(largest_error(), 1e-4);
  std::ofstream(folder / "out/summary.json")
      << R"({"main_map": 0, "maps": [{"id": 0, "gauge": {"kind": "free"}}]})";
  EXPECT_GT(largest_error(), 100);
  std::ofstream(folder / "out/summary.json") << "{";
  EXPECT_THROW(LoadEstimate(trajectory, truth), Error);
  fs::remove_all(folder);
}

TEST(LoadTruth, AMissingPathIsAnErrorThatNamesIt) {
  try {
    LoadTruth("/nowhere/truth.txt");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/truth.txt"), std::string::npos);
  }
}

TEST(LoadTruth, AReceiversFileBesidePhotographsComesBeforeTheirExif) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / "deepuav_receiver_beside_test";
  std::filesystem::create_directories(folder / "images");
  std::ofstream(folder / "gps.csv")
      << "time [us],latitude [deg],longitude [deg],altitude [m]\n"
         "1768248348000000,14.5371,121.3732,428\n1768248349000000,14.5372,121.3732,428\n";
  const Truth truth = LoadTruth(folder);
  EXPECT_EQ(truth.trajectory.size(), 2u);
  EXPECT_TRUE(truth.has_own_clock);
  ASSERT_TRUE(truth.origin);
  EXPECT_NEAR(truth.origin->latitude_deg, 14.5371, 1e-6);
  std::filesystem::remove_all(folder);
}

TEST(LoadTruth, PhotographsGiveFixes) {
  const char* shared = std::getenv("DEEPUAV_SHARED");
  const std::filesystem::path survey =
      std::filesystem::path(shared ? shared : "../shared") / "data/uav_nadir_survey";
  if (!std::filesystem::exists(survey)) GTEST_SKIP() << "no " << survey;
  const Truth truth = LoadTruth(survey);
  EXPECT_EQ(truth.trajectory.size(), 172u);
  EXPECT_FALSE(truth.has_orientation);
  EXPECT_FALSE(truth.has_altitude);
  EXPECT_FALSE(truth.has_own_clock);
  double path_m = 0;
  for (size_t i = 1; i < truth.trajectory.size(); ++i) {
    path_m += (truth.trajectory[i].world_from_cam.translation() -
               truth.trajectory[i - 1].world_from_cam.translation())
                  .norm();
  }
  EXPECT_NEAR(path_m, 1560, 10);
}

}  // namespace
}  // namespace deepuav
