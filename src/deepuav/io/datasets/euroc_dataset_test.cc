#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>

#include "deepuav/io/testing/dataset_fixture.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

class EurocTest : public DatasetTest {
 protected:
  EurocTest() {
    folder_.Write("mav0/cam0/sensor.yaml", kTestSensorYaml);
    WriteList(
        "#timestamp [ns],filename\r\n1403636579763555584,a.jpg\r\n1403636579813555456,b.jpg\r\n");
    WriteFrames("mav0/cam0/data/", {"a.jpg", "b.jpg"});
  }
  void WriteList(const std::string& text) { folder_.Write("mav0/cam0/data.csv", text); }
  std::string ListError(const std::string& text) {
    WriteList(text);
    const std::string message = OpenError();
    const std::string file = Path("mav0/cam0/data.csv");
    EXPECT_TRUE(message.starts_with(file)) << message;
    return message.substr(std::min(message.size(), file.size()));
  }
  std::string SensorError(std::string_view from, std::string_view to) {
    folder_.Write("mav0/cam0/sensor.yaml", Replaced(ToString(kTestSensorYaml), from, to));
    const std::string message = OpenError();
    const std::string file = Path("mav0/cam0/sensor.yaml");
    EXPECT_TRUE(message.starts_with(file)) << message;
    return message.substr(std::min(message.size(), file.size()));
  }
};

TEST_F(EurocTest, OpensTheFolderAboveAndMav0Itself) {
  for (const std::string name : {"", "mav0", "mav0/"}) {
    const auto dataset = OpenDataset(folder_.path() / name);
    EXPECT_EQ(dataset->Kind(), "euroc");
    ASSERT_EQ(dataset->size(), 2);
    EXPECT_EQ(dataset->Time(1).nanoseconds, 1403636579813555456);
    EXPECT_TRUE(dataset->Name(1).ends_with("mav0/cam0/data/b.jpg"));
    EXPECT_EQ(dataset->camera().pinhole.fy, 46.5);
    EXPECT_EQ(dataset->camera().lens, LensModel::kRadialTangential);
    EXPECT_EQ(dataset->camera().rate_hz, 20);
    EXPECT_FALSE(dataset->CalibrationIsApproximate());
    EXPECT_TRUE(dataset->ReadSensors().gnss.fixes.empty());
    ASSERT_TRUE(dataset->BodyFromCam());
    EXPECT_NEAR(dataset->BodyFromCam()->translation().y(), -0.064676986768, 1e-12);
    EXPECT_NEAR(dataset->BodyFromCam()->RotationMatrix()(0, 1), -0.999880929698, 1e-9);
    EXPECT_EQ(dataset->Load(0).size(), cv::Size(64, 48));
    EXPECT_NE(cv::countNonZero(dataset->Load(0) != dataset->Load(1)), 0);
  }
}

TEST_F(EurocTest, AFrameOutOfRangeIsAnError) {
  const auto dataset = Open();
  EXPECT_EQ(ErrorOf([&] { dataset->Load(2); }), "frame 2: expected 0 to 1");
  EXPECT_EQ(ErrorOf([&] { dataset->Time(-1); }), "frame -1: expected 0 to 1");
}

TEST_F(EurocTest, AMissingOrTruncatedImageFailsOnlyItself) {
  fs::remove(Path("mav0/cam0/data/a.jpg"));
  auto dataset = Open();
  EXPECT_NE(ErrorOf([&] { dataset->Load(0); }).find(Path("mav0/cam0/data/a.jpg")),
            std::string::npos);
  EXPECT_EQ(dataset->Load(1).size(), cv::Size(64, 48));

  folder_.Write("mav0/cam0/data/a.jpg", EncodedImage(64, 48, 1).substr(0, 300));
  dataset = Open();
  EXPECT_NE(ErrorOf([&] { dataset->Load(0); }).find(Path("mav0/cam0/data/a.jpg")),
            std::string::npos);
  EXPECT_EQ(dataset->Load(1).size(), cv::Size(64, 48));

  fs::remove_all(Path("mav0/cam0/data"));
  EXPECT_TRUE(OpenError().starts_with("none of the 2 images can be read; the first: "));
}

TEST_F(EurocTest, ImagesOfAnotherSizeAreAnError) {
  folder_.Write("mav0/cam0/data/a.jpg", EncodedImage(32, 48, 1));
  EXPECT_EQ(OpenError(), Path("mav0/cam0/data/a.jpg") + ": image is 32x48: expected 64x48 as in " +
                             Path("mav0/cam0/sensor.yaml"));
  WriteFrames("mav0/cam0/data/", {"a.jpg"});
  folder_.Write("mav0/cam0/data/b.jpg", EncodedImage(64, 40, 1));
  const auto dataset = Open();
  EXPECT_EQ(ErrorOf([&] { dataset->Load(1); }), Path("mav0/cam0/data/b.jpg") +
                                                    ": image is 64x40: expected 64x48 as in " +
                                                    Path("mav0/cam0/sensor.yaml"));
}

TEST_F(EurocTest, NamesTheLineOfAWrongFrameList) {
  EXPECT_EQ(ListError("# none\n"), ": lists no frame: expected 'nanoseconds,file name' lines");
  EXPECT_EQ(ListError("1,a.jpg\n1,b.jpg\n"),
            ":2: time stamp 1 ns does not come after the one before, 1 ns: expected growing times");
  EXPECT_EQ(ListError("5,a.jpg\n\n4,b.jpg\n"),
            ":3: time stamp 4 ns does not come after the one before, 5 ns: expected growing times");
  EXPECT_EQ(ListError("1,a.jpg\nx,b.jpg\n"), ":2: time is 'x': expected nanoseconds");
  EXPECT_EQ(ListError("1,a.jpg\n2\n"), ":2: 1 fields in '2': expected 'nanoseconds,file name'");
  EXPECT_EQ(ListError("1,\n"), ":1: file name is '': expected the name of an image");
  fs::remove(Path("mav0/cam0/data.csv"));
  EXPECT_EQ(OpenError(),
            Path("mav0/cam0/data.csv") + ": cannot be opened: No such file or directory");
}

TEST_F(EurocTest, NamesTheFieldOfAWrongSensorFile) {
  EXPECT_EQ(SensorError("camera_model: pinhole\n", ""),
            ": field 'camera_model' is missing: expected a word");
  EXPECT_EQ(SensorError("camera_model: pinhole", "camera_model: omni"),
            ":13: camera_model is 'omni': expected pinhole");
  EXPECT_EQ(
      SensorError("radial-tangential", "fov"),
      ":15: distortion_model is 'fov': expected one as pinhole, radial_tangential, equidistant");
  EXPECT_EQ(SensorError("distortion_model: radial-tangential\n", ""),
            ": field 'distortion_model' is missing: expected a word");
  EXPECT_THAT(SensorError("radial-tangential", "none"),
              testing::HasSubstr("4 coefficients: expected none for a pinhole"));
  EXPECT_EQ(SensorError("45.5, 46.5, 31.25, 24.75", "45.5, 46.5, 31.25"),
            ":14: intrinsics holds 3 numbers: expected 4 (fu, fv, cu, cv)");
  EXPECT_EQ(SensorError("45.5, 46.5", ".nan, 46.5"),
            ":14: intrinsics[0] is '.nan': expected a finite number");
  EXPECT_EQ(SensorError("[64, 48]", "[1e9, 48]"),
            ":12: resolution holds 1000000000: expected whole numbers from 1 to 30000");
  EXPECT_EQ(SensorError("[64, 48]", "[64]"),
            ":12: resolution holds 1 numbers: expected 2 (width, height)");
  EXPECT_EQ(
      SensorError(", 1.76187114e-05]", "]"),
      ":16: distortion_coefficients holds 3 coefficients: expected 4 or 5 (k1 k2 p1 p2 [k3])");
  EXPECT_EQ(SensorError("rate_hz: 20", "rate_hz: -20"),
            ":11: rate_hz is -20: expected more than 0");
  EXPECT_EQ(SensorError("rate_hz: 20\n", ""), ": field 'rate_hz' is missing: expected a number");
  EXPECT_EQ(SensorError("0.0, 0.0, 0.0, 1.0]", "0.0, 0.0, 0.0, 1.0, 2]"),
            ":7: T_BS.data holds 17 numbers: expected 16, a 4x4 matrix by rows");
  EXPECT_EQ(SensorError("0.0, 0.0, 0.0, 1.0]", "0.0, 0.0, 0.5, 1.0]"),
            ":7: the last row of T_BS is 0 0 0.5 1: expected 0 0 0 1");
  EXPECT_TRUE(SensorError("0.0148655429818", "0.9").starts_with(":7: T_BS holds no rotation"));
  EXPECT_TRUE(SensorError("[0.0148655429818, -0.999880929698, 0.00414029679422",
                          "[-0.0148655429818, 0.999880929698, -0.00414029679422")
                  .starts_with(":7: T_BS holds no rotation"));
}

TEST_F(EurocTest, TakesTheNamesOfLensModels) {
  folder_.Write("mav0/cam0/sensor.yaml",
                Replaced(ToString(kTestSensorYaml), "radial-tangential", "radtan"));
  EXPECT_EQ(Open()->camera().lens, LensModel::kRadialTangential);
  folder_.Write(
      "mav0/cam0/sensor.yaml",
      Replaced(Replaced(ToString(kTestSensorYaml), "radial-tangential", "equidistant"),
               "[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]", "[0.01, 0.001, 0, 0]"));
  EXPECT_EQ(Open()->camera().lens, LensModel::kEquidistant);
}

TEST_F(EurocTest, ACameraFileOverridesTheSensorFile) {
  DatasetOptions options;
  options.camera_file =
      folder_.Write("other.yaml", Replaced(ToString(kTestCameraYaml), "45.5", "50"));
  const auto dataset = Open(options);
  EXPECT_EQ(dataset->camera().pinhole.fx, 50);
  EXPECT_TRUE(dataset->BodyFromCam());
}

TEST_F(EurocTest, WithoutSensorFileNeedsACameraFile) {
  fs::remove(Path("mav0/cam0/sensor.yaml"));
  EXPECT_TRUE(OpenError().starts_with(Path("mav0/cam0/sensor.yaml") + ": no calibration"));
  folder_.Write("camera.yaml", kTestCameraYaml);
  EXPECT_EQ(Open()->camera().pinhole.fx, 45.5);
  EXPECT_FALSE(Open()->BodyFromCam());
}

}  // namespace
}  // namespace deepuav
