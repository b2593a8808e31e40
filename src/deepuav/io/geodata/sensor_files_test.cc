#include "deepuav/io/geodata/sensor_files.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/io/datasets/euroc_writer.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

constexpr Timestamp kTime{1700000000000000000};

class SensorFilesTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(SensorFilesTest, ReadWhatASimulatedFlightWrites) {
  const auto mav0 = folder_.path() / "mav0";
  WriteEurocImu(mav0, 200, {1e-3, 2e-5, 3e-3, 4e-4},
                std::vector<ImuSample>{{kTime, {0.1, 0.2, 0.3}, {0.4, 0.5, 9.81}}});
  WriteEurocGnss(mav0, 5, {-0.1, 0, 0.12},
                 std::vector<GnssFix>{{kTime, 47.3977, 8.5456, 517.25, {0.8, 0.9, 1.5}}});
  WriteEurocBarometer(mav0, 20, std::vector<BarometerSample>{{kTime, 95321.25, 516.5}});
  const SE3 body_from_cam(RotationExp({0, 0, 1.5707963267948966}), Eigen::Vector3d(0.2, 0, 0));
  const SensorStreams streams = ReadEurocSensors(mav0, body_from_cam);

  ASSERT_EQ(streams.imu.samples.size(), 1u);
  EXPECT_EQ(streams.imu.samples[0].angular_velocity.y(), 0.2);
  EXPECT_EQ(streams.imu.samples[0].specific_force.z(), 9.81);
  EXPECT_EQ(streams.imu.noise.accelerometer_random_walk, 4e-4);
  ASSERT_EQ(streams.gnss.fixes.size(), 1u);
  EXPECT_EQ(streams.gnss.fixes[0].altitude_m, 517.25);
  EXPECT_EQ(streams.gnss.fixes[0].sigma_m, Eigen::Vector3d(0.8, 0.9, 1.5));
  EXPECT_LT((streams.gnss.antenna_cam_m - Eigen::Vector3d(0, 0.3, 0.12)).norm(), 1e-9);
  ASSERT_EQ(streams.barometer.samples.size(), 1u);
  EXPECT_EQ(streams.barometer.samples[0].altitude_m, 516.5);
  EXPECT_LT((streams.barometer.sensor_cam_m - Eigen::Vector3d(0, 0.2, 0)).norm(), 1e-9);
}

TEST_F(SensorFilesTest, SensorsThatAreNotThereHaveNoSamples) {
  const SensorStreams streams = ReadEurocSensors(folder_.path(), std::nullopt);
  EXPECT_TRUE(streams.imu.samples.empty());
  EXPECT_TRUE(streams.gnss.fixes.empty());
  EXPECT_TRUE(streams.barometer.samples.empty());
}

TEST_F(SensorFilesTest, SayWhichLineIsWrong) {
  folder_.Write("baro0/data.csv", "#time\n1000,95000,500\n900,95000,500\n");
  EXPECT_NE(ErrorOf([&] {
              ReadBarometerFile(folder_.path() / "baro0/data.csv");
            }).find("data.csv:3: time stamp 900 ns"),
            std::string::npos);
  folder_.Write("imu0/data.csv", "1000,1,2,3,4,5\n");
  EXPECT_NE(ErrorOf([&] {
              ReadImuFile(folder_.path() / "imu0/data.csv");
            }).find("data.csv:1: 6 fields: expected 7"),
            std::string::npos);
}

}  // namespace
}  // namespace deepuav
