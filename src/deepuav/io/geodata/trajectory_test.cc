#include "deepuav/io/geodata/trajectory.h"

#include <limits>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

class TrajectoryTest : public ::testing::Test {
 protected:
  Trajectory Read(const std::string& text) {
    return ReadTrajectory(folder_.Write("poses.txt", text));
  }
  std::string Message(const std::string& text) {
    const std::string message = ErrorOf([&] { Read(text); });
    const std::string file = (folder_.path() / "poses.txt").string();
    EXPECT_TRUE(message.starts_with(file)) << message;
    return message.substr(std::min(file.size(), message.size()));
  }

  TemporaryFolder folder_;
};

TEST_F(TrajectoryTest, ReadsTum) {
  const Trajectory poses = Read(
      "# timestamp tx ty tz qx qy qz qw\r\n"
      "1403636584.763555584 1 2 3 0 0 1 0\r\n"
      "1.4036365848e+09  -1.5 2e-3 +3 0 0 0 1\n");
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].time.nanoseconds, 1403636584763555584);
  EXPECT_EQ(poses[1].time.nanoseconds, 1403636584800000000);
  EXPECT_EQ(poses[1].world_from_cam.translation(), Eigen::Vector3d(-1.5, 2e-3, 3));
  EXPECT_TRUE((poses[0].world_from_cam * Eigen::Vector3d(1, 0, 0))
                  .isApprox(Eigen::Vector3d(0, 2, 3), 1e-12));
}

TEST_F(TrajectoryTest, ReadsEurocCsv) {
  const Trajectory poses = Read(
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v...\n"
      "1403636580838555648,4.688319,-1.786938,0.783338,0,0,0,1,-0.027876,0.033207,0.800006,-0."
      "003172,0.021267\n"
      "1403636580843555328, "
      "4.688177,-1.786770,0.787350,1,0,0,0,-0.029272,0.033992,0.8,-0.003172,0.021267\n");
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].time.nanoseconds, 1403636580838555648);
  EXPECT_TRUE((poses[0].world_from_cam * Eigen::Vector3d(1, 0, 0))
                  .isApprox(Eigen::Vector3d(3.688319, -1.786938, 0.783338), 1e-12));
  EXPECT_NEAR(poses[1].world_from_cam.Angle(), 0, 1e-12);
}

TEST_F(TrajectoryTest, ReadsKittiWithAndWithoutTimes) {
  const std::string text = "1 0 0 1.5 0 1 0 2.5 0 0 1 3.5\n0 -1 0 4 1 0 0 5 0 0 1 6\n";
  const Trajectory poses = Read(text);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[1].time.nanoseconds, 1000000000);
  EXPECT_EQ(poses[0].world_from_cam.translation(), Eigen::Vector3d(1.5, 2.5, 3.5));
  EXPECT_TRUE((poses[1].world_from_cam * Eigen::Vector3d(1, 0, 0))
                  .isApprox(Eigen::Vector3d(4, 6, 6), 1e-12));

  const auto times = folder_.Write("times.txt", "0.000000e+00\n1.036224e-01\n");
  const Trajectory timed = ReadTrajectory(folder_.path() / "poses.txt", times);
  EXPECT_EQ(timed[1].time.nanoseconds, 103622400);

  folder_.Write("times.txt", "0\n");
  EXPECT_EQ(ErrorOf([&] { ReadTrajectory(folder_.path() / "poses.txt", times); }),
            times.string() + ": holds 1 times: expected 2, one for each pose of " +
                (folder_.path() / "poses.txt").string());
  folder_.Write("times.txt", "1\n1\n");
  EXPECT_EQ(
      ErrorOf([&] { ReadTrajectory(folder_.path() / "poses.txt", times); }),
      times.string() + ":2: the time does not come after the one before: expected growing times");
  const auto tum = folder_.Write("tum.txt", "0 0 0 0 0 0 0 1\n");
  EXPECT_NE(ErrorOf([&] { ReadTrajectory(tum, times); }).find("expected KITTI poses"),
            std::string::npos);
}

TEST_F(TrajectoryTest, NamesTheLineOfAMistake) {
  const std::string first = "1 0 0 0 0 0 0 1\n";
  EXPECT_EQ(Message(first + "2 0 0 x 0 0 0 1\n"), ":2: field 4 is 'x': expected a finite number");
  EXPECT_EQ(Message(first + "2 0 0 nan 0 0 0 1\n"),
            ":2: field 4 is 'nan': expected a finite number");
  EXPECT_EQ(Message(first + "2 0 0 0 0 0 1\n"),
            ":2: 7 fields: expected 8 (seconds tx ty tz qx qy qz qw)");
  EXPECT_EQ(Message(first + "2 0 0 0 0 0 0 0.5\n"),
            ":2: the quaternion has length 0.5: expected 1");
  EXPECT_EQ(Message(first + "# note\n1 0 0 0 0 0 0 1\n"),
            ":3: time stamp 1000000000 ns does not come after the one before, 1000000000 ns: "
            "expected growing times");
  EXPECT_EQ(Message(first + "0.5 0 0 0 0 0 0 1\n"),
            ":2: time stamp 500000000 ns does not come after the one before, 1000000000 ns: "
            "expected growing times");
  EXPECT_EQ(Message("1403636580838555648,1,2,3,1,0,0\n"),
            ":1: 7 fields: expected at least 8 (ns,px,py,pz,qw,qx,qy,qz)");
  EXPECT_EQ(Message("1403636580838555648 0 0 0 0 0 0 1\n"),
            ":1: time is '1403636580838555648': expected decimal seconds of at most 9223372036");
  EXPECT_EQ(Message("1 0 0 1 0 1 0 2 0 0 1 3\n2 0 0 1 0 1 0 2 0 0 1 3\n").substr(0, 31),
            ":2: the pose holds no rotation ");
  EXPECT_EQ(Message("-1 0 0 1 0 1 0 2 0 0 1 3\n").substr(0, 31), ":1: the pose holds no rotation ");
  EXPECT_EQ(Message("# nothing\n"), ": holds no pose");
  EXPECT_TRUE(Message("hello world\n").starts_with(":1: 2 fields in 'hello world': expected TUM"));
}

TEST_F(TrajectoryTest, SurvivesWritingAndReading) {
  Trajectory written;
  written.push_back({{-1500000001}, SE3(RotationExp({0.1, -0.2, 0.3}), Eigen::Vector3d(1, 2, 3))});
  written.push_back({{-1}, SE3()});
  written.push_back({{1403636584763555584},
                     SE3(RotationExp({3, 0.2, 0.1}), Eigen::Vector3d(-100.123456789, 2e-7, 3))});
  const auto file = folder_.path() / "trajectory.txt";
  WriteTrajectory(file, written);
  const Trajectory read = ReadTrajectory(file);
  ASSERT_EQ(read.size(), written.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].time, written[i].time);
    EXPECT_LT(
        (read[i].world_from_cam.translation() - written[i].world_from_cam.translation()).norm(),
        1e-9);
    EXPECT_LT((read[i].world_from_cam.Inverse() * written[i].world_from_cam).Angle(), 1e-8);
  }
  EXPECT_NE(ReadAll(file).find("\n1403636584.763555584 -100.123456789 0.000000200 3.000000000 "),
            std::string::npos);
  EXPECT_NE(ReadAll(file).find("\n-1.500000001 "), std::string::npos);
}

TEST_F(TrajectoryTest, WritingNamesTheFileAndKeepsTheOldOne) {
  EXPECT_EQ(ErrorOf([] { WriteTrajectory("/nowhere/t.txt", {}); }),
            "/nowhere/t.txt: cannot be created: No such file or directory");
  const auto file = folder_.Write("t.txt", "old");
  const Trajectory broken = {
      {{5},
       SE3(Eigen::Quaterniond::Identity(),
           Eigen::Vector3d(std::numeric_limits<double>::quiet_NaN(), 0, 0))}};
  EXPECT_EQ(ErrorOf([&] { WriteTrajectory(file, broken); }),
            file.string() + ": the pose at 5 ns is not finite");
  EXPECT_EQ(ReadAll(file), "old");
}

TEST(RealTrajectories, AreRead) {
  const auto shared = SharedFolder();
  if (!shared) GTEST_SKIP() << "no real sequences: set DEEPUAV_SHARED to their folder";
  const Trajectory euroc = ReadTrajectory(*shared / "data/euroc_mh01_excerpt/groundtruth_cam0.csv");
  ASSERT_EQ(euroc.size(), 344u);
  EXPECT_EQ(euroc[0].time.nanoseconds, 1403636584663555584);
  EXPECT_EQ(euroc[0].world_from_cam.translation(),
            Eigen::Vector3d(4.6523076412, -1.8195301305, 0.9621520884));
  EXPECT_NEAR(euroc[0].world_from_cam.rotation().w(), 0.4820276179, 1e-9);
  const Trajectory scenes = ReadTrajectory(*shared / "data/7scenes_redkitchen/groundtruth.txt");
  ASSERT_EQ(scenes.size(), 1000u);
  EXPECT_EQ(scenes[1].time.nanoseconds, 33333000);
}

}  // namespace
}  // namespace deepuav
