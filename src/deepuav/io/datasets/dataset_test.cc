#include "deepuav/io/datasets/dataset.h"

#include <gmock/gmock.h>

#include <functional>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;
using ::testing::Test;

class DatasetTest : public Test {
 protected:
  std::string Path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::unique_ptr<Dataset> Open(const DatasetOptions& options = {}) {
    return OpenDataset(folder_.path(), options);
  }
  std::string OpenError() {
    return ErrorOf([&] { Open(); });
  }
  void WriteFrames(const std::string& prefix, const std::vector<std::string>& names) {
    for (size_t i = 0; i < names.size(); ++i) {
      folder_.Write(prefix + names[i],
                    EncodedImage(64, 48, static_cast<int>(i), fs::path(names[i]).extension()));
    }
  }

  TemporaryFolder folder_;
};

std::string ToString(std::string_view text) { return std::string(text); }

TEST_F(DatasetTest, AnUnknownLayoutListsTheKnownOnes) {
  folder_.Write("notes.txt", "hello");
  const std::string message = OpenError();
  EXPECT_TRUE(message.starts_with(folder_.path().string() + ": no known layout")) << message;
  for (const char* layout : {"mav0/", "rgb.txt", "image_0/", "times.txt", "calib.txt", "jpg"}) {
    EXPECT_NE(message.find(layout), std::string::npos) << layout;
  }
}

TEST_F(DatasetTest, WhatIsNoDatasetIsNamed) {
  EXPECT_EQ(OpenError(), folder_.path().string() + ": the folder is empty: expected a dataset");
  EXPECT_EQ(ErrorOf([] { OpenDataset("/nowhere/set"); }),
            "/nowhere/set: there is no such file or folder: expected a dataset");
  const std::string text = folder_.Write("a.txt", "x").string();
  EXPECT_TRUE(
      ErrorOf([&] { OpenDataset(text); }).starts_with(text + ": is no folder and no known video"));
}

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

class TumTest : public DatasetTest {
 protected:
  TumTest() {
    folder_.Write("camera.yaml", kTestCameraYaml);
    folder_.Write("rgb.txt",
                  "# color images\n# timestamp filename\n1305031102.175304 "
                  "rgb/a.png\n1305031102.211214 rgb/b.png\n");
    WriteFrames("rgb/", {"a.png", "b.png"});
  }
  std::string ListError(const std::string& text) {
    folder_.Write("rgb.txt", text);
    const std::string message = OpenError();
    EXPECT_TRUE(message.starts_with(Path("rgb.txt"))) << message;
    return message.substr(std::min(message.size(), Path("rgb.txt").size()));
  }
};

TEST_F(TumTest, Opens) {
  const auto dataset = Open();
  EXPECT_EQ(dataset->Kind(), "tum");
  ASSERT_EQ(dataset->size(), 2);
  EXPECT_EQ(dataset->Time(0).nanoseconds, 1305031102175304000);
  EXPECT_EQ(dataset->Name(0), Path("rgb/a.png"));
  EXPECT_EQ(dataset->Load(1).size(), cv::Size(64, 48));
  EXPECT_FALSE(dataset->BodyFromCam());
}

TEST_F(TumTest, NamesTheLineOfAWrongFrameList) {
  EXPECT_EQ(ListError("# none\n"), ": lists no frame: expected 'seconds file' lines");
  EXPECT_EQ(ListError("1 rgb/a.png\n0.5 rgb/b.png\n"),
            ":2: time stamp 500000000 ns does not come after the one before, 1000000000 ns: "
            "expected growing times");
  EXPECT_EQ(ListError("1 rgb/a.png\nnan rgb/b.png\n"),
            ":2: time is 'nan': expected decimal seconds of at most 9223372036");
  EXPECT_EQ(ListError("1 rgb/a.png rgb/b.png\n"),
            ":1: 3 fields in '1 rgb/a.png rgb/b.png': expected 'seconds file'");
}

TEST_F(TumTest, NeedsACameraFile) {
  fs::remove(Path("camera.yaml"));
  EXPECT_EQ(OpenError(), Path("camera.yaml") + ": cannot be opened: No such file or directory");
  folder_.Write("camera.yaml", "model: auto\n");
  EXPECT_TRUE(
      OpenError().starts_with(Path("camera.yaml") + ": model is 'auto' without intrinsics"));
}

TEST_F(TumTest, TheRateIsThatOfTheTimesWhereTheFileGivesNone) {
  folder_.Write("camera.yaml", Replaced(ToString(kTestCameraYaml), "rate_hz: 20.0\n", ""));
  EXPECT_NEAR(Open()->camera().rate_hz, 1 / 0.03591, 1e-6);
}

class KittiTest : public DatasetTest {
 protected:
  KittiTest() {
    folder_.Write(
        "calib.txt",
        "P0: 45.5 0 31.25 0 0 46.5 24.75 0 0 0 1 0\nP1: 45.5 0 31.25 -9 0 46.5 24.75 0 0 0 1 0\n");
    folder_.Write("times.txt", "0.000000e+00\n1.036224e-01\n2.072e-01\n");
    WriteFrames("image_0/", {"000000.png", "000001.png", "000002.png"});
  }
  std::string FileError(const std::string& file, const std::string& text) {
    folder_.Write(file, text);
    const std::string message = OpenError();
    EXPECT_TRUE(message.starts_with(Path(file))) << message;
    return message.substr(std::min(message.size(), Path(file).size()));
  }
};

TEST_F(KittiTest, Opens) {
  const auto dataset = Open();
  EXPECT_EQ(dataset->Kind(), "kitti");
  ASSERT_EQ(dataset->size(), 3);
  EXPECT_EQ(dataset->Time(1).nanoseconds, 103622400);
  EXPECT_EQ(dataset->camera().width, 64);
  EXPECT_EQ(dataset->camera().height, 48);
  EXPECT_EQ(dataset->camera().pinhole.fx, 45.5);
  EXPECT_EQ(dataset->camera().pinhole.fy, 46.5);
  EXPECT_EQ(dataset->camera().pinhole.cx, 31.25);
  EXPECT_EQ(dataset->camera().pinhole.cy, 24.75);
  EXPECT_NEAR(dataset->camera().rate_hz, 9.65, 0.01);
}

TEST_F(KittiTest, AMissingImageIsOnlyThatFrame) {
  fs::remove(Path("image_0/000000.png"));
  const auto dataset = Open();
  ASSERT_EQ(dataset->size(), 3);
  EXPECT_NE(ErrorOf([&] { dataset->Load(0); }).find("000000.png"), std::string::npos);
  EXPECT_EQ(dataset->Name(2), Path("image_0/000002.png"));
  EXPECT_EQ(dataset->Load(2).size(), cv::Size(64, 48));
}

TEST_F(KittiTest, NamesTheLineOfAMistake) {
  EXPECT_EQ(FileError("times.txt", "0\n0\n1\n"),
            ":2: time stamp 0 ns does not come after the one before, 0 ns: expected growing times");
  EXPECT_EQ(FileError("times.txt", "0\n1\n"),
            ": holds 2 times: expected 3, one for each image up to 000002.png");
  EXPECT_EQ(FileError("times.txt", "0\n1\nx\n"),
            ":3: time is 'x': expected decimal seconds of at most 9223372036");
  folder_.Write("times.txt", "0\n1\n2\n");
  EXPECT_EQ(FileError("calib.txt", "P1: 1\n"),
            ": line 'P0:' is missing: expected the projection of camera 0");
  EXPECT_EQ(FileError("calib.txt", "\nP0: 1 2 3\n"),
            ":2: P0 holds 3 numbers: expected 12, a 3x4 matrix by rows");
  EXPECT_EQ(FileError("calib.txt", "P0: x 0 31.25 0 0 46.5 24.75 0 0 0 1 0\n"),
            ":1: P0[0] is 'x': expected a finite number");
  EXPECT_TRUE(FileError("calib.txt", "P0: 45 1 31.25 0 0 46.5 24.75 0 0 0 1 0\n")
                  .starts_with(":1: P0 is no projection"));
  EXPECT_NE(FileError("calib.txt", "P0: -45 0 31.25 0 0 46.5 24.75 0 0 0 1 0\n").find("fx"),
            std::string::npos);
  fs::remove(Path("calib.txt"));
  EXPECT_TRUE(OpenError().starts_with(Path("calib.txt") + ": no calibration"));
  folder_.Write("camera.yaml", kTestCameraYaml);
  EXPECT_EQ(Open()->camera().lens, LensModel::kRadialTangential);
}

TEST_F(KittiTest, NamesWrongImages) {
  folder_.Write("image_0/left.png", "");
  EXPECT_EQ(OpenError(),
            Path("image_0") + ": image is called 'left.png': expected a number such as 000000.png");
  fs::remove_all(Path("image_0"));
  fs::create_directory(Path("image_0"));
  EXPECT_EQ(OpenError(), Path("image_0") + ": holds no image: expected 000000.png and so on");
  fs::remove(Path("times.txt"));
  EXPECT_EQ(OpenError(), Path("times.txt") + ": cannot be opened: No such file or directory");
}

TEST(RealDatasets, Open) {
  const auto shared = SharedFolder();
  if (!shared) GTEST_SKIP() << "no real sequences: set DEEPUAV_SHARED to their folder";
  const auto euroc = OpenDataset(*shared / "data/euroc_mh01_excerpt");
  EXPECT_EQ(euroc->Kind(), "euroc");
  EXPECT_EQ(euroc->size(), 340);
  EXPECT_EQ(euroc->camera().pinhole.fx, 458.654);
  EXPECT_EQ(euroc->camera().pinhole.cy, 248.375);
  EXPECT_EQ(euroc->camera().distortion,
            (std::vector<double>{-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}));
  EXPECT_EQ(euroc->Load(339).size(), cv::Size(752, 480));

  const auto scenes = OpenDataset(*shared / "data/7scenes_redkitchen");
  EXPECT_EQ(scenes->Kind(), "tum");
  EXPECT_EQ(scenes->size(), 1000);
  EXPECT_EQ(scenes->camera().pinhole.fx, 585);
  EXPECT_EQ(scenes->Load(999).size(), cv::Size(640, 480));

  const auto survey = OpenDataset(*shared / "data/uav_nadir_survey");
  EXPECT_EQ(survey->Kind(), "photographs");
  EXPECT_EQ(survey->size(), 172);
  EXPECT_TRUE(survey->CalibrationIsApproximate());
  EXPECT_NEAR(survey->camera().pinhole.fx, 462.25, 0.01);
  const std::vector<GnssFix> fixes = survey->ReadSensors().gnss.fixes;
  ASSERT_EQ(fixes.size(), 172u);
  EXPECT_NEAR(fixes[0].latitude_deg, 28 + 2 / 60.0 + 28.5116 / 3600, 1e-9);
  EXPECT_NEAR(fixes[0].longitude_deg, -(82 + 41 / 60.0 + 54.5072 / 3600), 1e-9);
  EXPECT_EQ(survey->Load(171).size(), cv::Size(800, 600));
  for (int i = 1; i < survey->size(); ++i) {
    EXPECT_GT(survey->Time(i), survey->Time(i - 1));
    EXPECT_GT(survey->Name(i), survey->Name(i - 1));
    EXPECT_EQ(fixes[static_cast<size_t>(i)].time, survey->Time(i));
  }
}

}  // namespace
}  // namespace deepuav
