#include "deepuav/io/cameras/calibration_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class CalibrationFormatsTest : public testing::Test {
 protected:
  Camera Read(const std::string& text, const std::string& name = "camera.yaml") {
    const CameraFile read = ReadCameraFile(folder_.Write(name, text));
    EXPECT_FALSE(read.refine);
    EXPECT_TRUE(read.has_intrinsics);
    return read.camera;
  }
  std::string ErrorOf(const std::string& text, const std::string& name = "camera.yaml") {
    return deepuav::ErrorOf([&] { ReadCameraFile(folder_.Write(name, text)); });
  }
  static void CheckPinhole(const Camera& camera) {
    EXPECT_EQ(camera.width, 752);
    EXPECT_EQ(camera.height, 480);
    EXPECT_EQ(camera.pinhole.fx, 458.5);
    EXPECT_EQ(camera.pinhole.fy, 457.5);
    EXPECT_EQ(camera.pinhole.cx, 367);
    EXPECT_EQ(camera.pinhole.cy, 248);
  }

  TemporaryFolder folder_;
};

TEST_F(CalibrationFormatsTest, Kalibr) {
  const Camera camera = Read(
      "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n"
      "  distortion_coeffs: [-0.25, 0.07, 0.001, 0.002]\n  intrinsics: [458.5, 457.5, 367, 248]\n"
      "  resolution: [752, 480]\n  rostopic: /cam0\n"
      "cam1:\n  camera_model: omni\n");
  CheckPinhole(camera);
  EXPECT_EQ(camera.lens, LensModel::kRadialTangential);
  EXPECT_THAT(camera.distortion, ElementsAre(-0.25, 0.07, 0.001, 0.002));
  const Camera none = Read(
      "cam0: {camera_model: pinhole, distortion_model: none, distortion_coeffs: [], "
      "intrinsics: [458.5, 457.5, 367, 248], resolution: [752, 480]}\n");
  EXPECT_EQ(none.lens, LensModel::kPinhole);
  EXPECT_THAT(ErrorOf("cam0: {camera_model: omni, intrinsics: [1, 1, 1, 1], resolution: [7, 4]}\n"),
              AllOf(HasSubstr("cam0.camera_model is 'omni'"), HasSubstr("expected pinhole")));
  EXPECT_THAT(ErrorOf("cam0: {camera_model: pinhole, intrinsics: [1, 1], resolution: [7, 4]}\n"),
              HasSubstr("cam0.intrinsics holds 2 numbers: expected 4"));
}

TEST_F(CalibrationFormatsTest, SensorOfEuroc) {
  const Camera camera = Read(
      "sensor_type: camera\nrate_hz: 20\nreadout_ms: 15\nresolution: [752, 480]\ncamera_model: "
      "pinhole\n"
      "intrinsics: [458.5, 457.5, 367, 248]\ndistortion_model: radial-tangential\n"
      "distortion_coefficients: [-0.25, 0.07, 0.001, 0.002]\n");
  CheckPinhole(camera);
  EXPECT_EQ(camera.distortion.size(), 4u);
  EXPECT_EQ(camera.rate_hz, 20);
  EXPECT_DOUBLE_EQ(camera.readout_s, 0.015);
}

TEST_F(CalibrationFormatsTest, RosAndOpenCv) {
  const std::string matrix = "[458.5, 0, 367, 0, 457.5, 248, 0, 0, 1]";
  const Camera ros = Read(
      "image_width: 752\nimage_height: 480\ncamera_name: front\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: " +
      matrix +
      "\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
      "  data: [-0.25, 0.07, 0.001, 0.002, 0.01]\n");
  CheckPinhole(ros);
  EXPECT_EQ(ros.lens, LensModel::kRadialTangential);
  EXPECT_EQ(ros.distortion.size(), 5u);
  const Camera opencv = Read(
      "%YAML:1.0\n---\ncalibration_time: \"today\"\nimage_width: 752\nimage_height: 480\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: " +
      matrix +
      "\ndistortion_coefficients: !!opencv-matrix\n   rows: 8\n   cols: 1\n   dt: d\n"
      "   data: [ -0.25, 0.07, 0.001, 0.002, 0.01, 0., 0., 0. ]\n");
  CheckPinhole(opencv);
  EXPECT_EQ(opencv.distortion.size(), 5u);
  const Camera fisheye =
      Read("image_width: 752\nimage_height: 480\ncamera_matrix: {data: " + matrix +
           "}\ndistortion_model: equidistant\n"
           "distortion_coefficients: {data: [0.01, 0.02, 0.03, 0.04]}\n");
  EXPECT_EQ(fisheye.lens, LensModel::kEquidistant);
  const Camera opencv_fisheye = Read(
      "image_width: 752\nimage_height: 480\nfisheye_model: 1\ncamera_matrix: {data: " + matrix +
      "}\ndistortion_coefficients: {data: [0.01, 0.02, 0.03, 0.04]}\n");
  EXPECT_EQ(opencv_fisheye.lens, LensModel::kEquidistant);
  EXPECT_THAT(
      ErrorOf("image_width: 752\nimage_height: 480\ncamera_matrix: {data: " + matrix +
              "}\ndistortion_model: rational_polynomial\n"
              "distortion_coefficients: {data: [1, 2, 3, 4, 5, 6, 7, 8]}\n"),
      AllOf(HasSubstr("camera.yaml:4"), HasSubstr("'rational_polynomial'"), HasSubstr("expected")));
  EXPECT_THAT(ErrorOf("image_width: 752\nimage_height: 480\ncamera_matrix: {data: " + matrix +
                      "}\ndistortion_coefficients: {data: [.1, 0, 0, 0, 0, 0, 0, .1]}\n"),
              HasSubstr("8 coefficients"));
}

TEST_F(CalibrationFormatsTest, OrbSlam) {
  const Camera three = Read(
      "%YAML:1.0\n\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 458.5\n"
      "Camera1.fy: 457.5\nCamera1.cx: 367\nCamera1.cy: 248\nCamera1.k1: -0.25\nCamera1.k2: 0.07\n"
      "Camera1.p1: 0.001\nCamera1.p2: 0.002\nCamera.width: 752\nCamera.height: 480\n"
      "Camera.newWidth: 600\nCamera.fps: 20\nORBextractor.nFeatures: 1000\n");
  CheckPinhole(three);
  EXPECT_EQ(three.rate_hz, 20);
  EXPECT_EQ(three.distortion[3], 0.002);
  const std::string old =
      "Camera.fx: 458.5\nCamera.fy: 457.5\nCamera.cx: 367\nCamera.cy: 248\n"
      "Camera.width: 752\nCamera.height: 480\n";
  const Camera plain = Read(old + "Camera.k1: 0.0\n");
  CheckPinhole(plain);
  EXPECT_EQ(plain.lens, LensModel::kPinhole);
  EXPECT_THAT(plain.distortion, IsEmpty());
  const Camera fisheye =
      Read(old + "Camera.type: \"KannalaBrandt8\"\nCamera.k1: 0.003\nCamera.k2: 0.001\n");
  EXPECT_EQ(fisheye.lens, LensModel::kEquidistant);
  EXPECT_THAT(fisheye.distortion, ElementsAre(0.003, 0.001, 0, 0));
  EXPECT_THAT(ErrorOf(old + "Camera.type: \"Omni\"\n"), HasSubstr("expected PinHole, Rectified"));
  EXPECT_THAT(ErrorOf("Camera.fx: 458.5\nCamera.fy: 457.5\n"),
              HasSubstr("'Camera.width' is missing"));
}

TEST_F(CalibrationFormatsTest, Colmap) {
  const std::string head = "# Camera list with one line of data per camera:\n";
  CheckPinhole(Read(head + "1 PINHOLE 752 480 458.5 457.5 367.5 248.5\n", "cameras.txt"));
  const Camera radial = Read("1 SIMPLE_RADIAL 752 480 458.5 367.5 248.5 -0.05\n", "cameras.txt");
  EXPECT_EQ(radial.pinhole.fy, 458.5);
  EXPECT_EQ(radial.pinhole.cx, 367);
  EXPECT_THAT(radial.distortion, ElementsAre(-0.05, 0, 0, 0));
  const Camera fisheye =
      Read("1 OPENCV_FISHEYE 752 480 458.5 457.5 367.5 248.5 .01 .02 .03 .04\n", "cameras.txt");
  EXPECT_EQ(fisheye.lens, LensModel::kEquidistant);
  EXPECT_EQ(fisheye.distortion.size(), 4u);
  EXPECT_THAT(ErrorOf("1 FOV 752 480 1 2 3 4 5\n", "cameras.txt"),
              AllOf(HasSubstr("cameras.txt:1"), HasSubstr("'FOV'"), HasSubstr("OPENCV")));
  EXPECT_THAT(ErrorOf("1 PINHOLE 752 480 458.5\n", "cameras.txt"),
              HasSubstr("PINHOLE has 1 parameters: expected 4"));
  EXPECT_THAT(ErrorOf("1 PINHOLE 7 4 1 1 1 1\n2 PINHOLE 7 4 1 1 1 1\n", "cameras.txt"),
              HasSubstr("lists 2 cameras: expected one"));
}

TEST_F(CalibrationFormatsTest, OtherNamesOfLenses) {
  const std::string rest =
      "\nwidth: 752\nheight: 480\nfx: 458.5\nfy: 457.5\ncx: 367\ncy: 248\ndistortion: [.01, 0, 0, "
      "0]\n";
  for (const char* name : {"radtan", "plumb_bob", "opencv", "brown_conrady"})
    EXPECT_EQ(Read("model: " + (name + rest)).lens, LensModel::kRadialTangential) << name;
  for (const char* name : {"fisheye", "kannala_brandt", "opencv_fisheye"})
    EXPECT_EQ(Read("model: " + (name + rest)).lens, LensModel::kEquidistant) << name;
  EXPECT_THAT(ErrorOf("model: pinhole" + rest), HasSubstr("radial_tangential has some"));
}

}  // namespace
}  // namespace deepuav
