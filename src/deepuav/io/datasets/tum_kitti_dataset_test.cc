#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "deepuav/io/testing/dataset_fixture.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

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

}  // namespace
}  // namespace deepuav
