#include "deepuav/io/datasets/euroc_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/files/yaml_map.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;

const Timestamp kTime{1'700'000'000'050'000'000};

Camera SmallCamera(LensModel lens) {
  Camera camera;
  camera.width = 64;
  camera.height = 48;
  camera.pinhole = {45.123456789012, 46.5, 31.25, 24.75};
  camera.lens = lens;
  if (lens == LensModel::kRadialTangential) camera.distortion = {-0.28, 0.07, 2e-4, 1.76e-5};
  if (lens == LensModel::kEquidistant) camera.distortion = {-0.01, 0.02, -0.003, 1e-4};
  camera.rate_hz = 12.5;
  return camera;
}

const SE3 kPose(RotationExp({0.3, -1.2, 2.1}), {1234.567891234567, -0.5, 1e-9});

TEST(EurocWriter, DatasetOpensWithItsCalibration) {
  for (const LensModel lens :
       {LensModel::kPinhole, LensModel::kRadialTangential, LensModel::kEquidistant}) {
    const TemporaryFolder folder;
    Camera camera = SmallCamera(lens);
    camera.readout_s = lens == LensModel::kEquidistant ? 0.0125 : 0;
    const std::string name = std::to_string(kTime.nanoseconds) + ".png";
    folder.Write("mav0/cam0/data/" + name, EncodedImage(64, 48, 1, ".png"));
    const std::vector<EurocImageName> images{{kTime, name}};
    WriteEurocCamera(folder.path() / "mav0", camera, kPose, images);

    const std::unique_ptr<Dataset> dataset = OpenDataset(folder.path());
    EXPECT_EQ(dataset->Kind(), "euroc");
    EXPECT_EQ(dataset->size(), 1);
    EXPECT_EQ(dataset->Time(0), kTime);
    EXPECT_EQ(dataset->Load(0).size(), cv::Size(64, 48));
    const Camera& read = dataset->camera();
    EXPECT_EQ(read.rate_hz, 12.5);
    EXPECT_EQ(read.readout_s, camera.readout_s);
    EXPECT_EQ(read.pinhole.fx, camera.pinhole.fx);
    const Eigen::Vector3d point(0.3, -0.2, 1.1);
    EXPECT_LT((*read.Distort(point) - *camera.Distort(point)).norm(), 1e-12);
    ASSERT_TRUE(dataset->BodyFromCam());
    EXPECT_LT((dataset->BodyFromCam()->Matrix() - kPose.Matrix()).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(EurocWriter, TruthReadsBack) {
  const TemporaryFolder folder;
  std::vector<TimedBodyState> states(2);
  states[0] = {kTime, kPose, {1, 2, 3}, {0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}};
  states[1].time = {kTime.nanoseconds + 5'000'000};
  WriteEurocBodyTruth(folder.path() / "mav0", states);
  WriteCameraTruth(folder.path(), {{kTime, kPose}});
  for (const char* file : {"mav0/state_groundtruth_estimate0/data.csv", "groundtruth_cam0.csv"}) {
    const Trajectory read = ReadTrajectory(folder.path() / file);
    ASSERT_FALSE(read.empty());
    EXPECT_EQ(read[0].time, kTime);
    EXPECT_LT((read[0].world_from_cam.Matrix() - kPose.Matrix()).cwiseAbs().maxCoeff(), 1e-11);
  }
  EXPECT_THAT(ReadAll(folder.path() / "mav0/state_groundtruth_estimate0/data.csv"),
              HasSubstr(",1.000000000000,2.000000000000,3.000000000000,0.010000000000,"
                        "0.020000000000,0.030000000000,0.100000000000,0.200000000000,"
                        "0.300000000000\n"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "mav0/body.yaml"));
}

TEST(EurocWriter, SensorsAreWrittenAsTheyAre) {
  const TemporaryFolder folder;
  const std::filesystem::path mav0 = folder.path() / "mav0";
  WriteEurocImu(mav0, 200, {1.6968e-4, 1.9393e-5, 2e-3, 3e-3},
                std::vector<ImuSample>{{kTime, {0.1, 0.2, 0.3}, {0.4, 0.5, 9.81}}});
  WriteEurocGnss(mav0, 5, {-0.1, 0, 0.12},
                 std::vector<GnssFix>{{kTime, 47.3977, 8.5456, 517.25, {0.8, 0.9, 1.5}}});
  WriteEurocBarometer(mav0, 20, std::vector<BarometerSample>{{kTime, 95321.25, 516.5}});
  EXPECT_THAT(ReadAll(mav0 / "imu0/data.csv"),
              HasSubstr("\n1700000000050000000,0.100000000000,0.200000000000,0.300000000000,"
                        "0.400000000000,0.500000000000,9.810000000000\n"));
  EXPECT_THAT(ReadAll(mav0 / "gps0/data.csv"),
              HasSubstr("\n1700000000050000000,47.3977000000,8.5456000000,517.2500,0.800,0.900,"
                        "1.500\n"));
  EXPECT_THAT(ReadAll(mav0 / "baro0/data.csv"),
              HasSubstr("\n1700000000050000000,95321.250,516.5000\n"));
  EXPECT_EQ(YamlMap::Read(mav0 / "imu0/sensor.yaml").Number("gyroscope_noise_density"), 1.6968e-4);
  const std::vector<double> antenna =
      YamlMap::Read(mav0 / "gps0/sensor.yaml").Map("T_BS").Numbers("data");
  EXPECT_EQ(antenna[3], -0.1);
  EXPECT_EQ(antenna[11], 0.12);
  EXPECT_EQ(YamlMap::Read(mav0 / "baro0/sensor.yaml").Number("rate_hz"), 20);
}

TEST(EurocWriter, NamesTheFileThatCannotBeWritten) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.Write("mav0", "no folder");
  EXPECT_THAT(ErrorOf([&] { WriteEurocBarometer(file, 20, {}); }), HasSubstr("baro0"));
}

}  // namespace
}  // namespace deepuav
