#include <gtest/gtest.h>

#include "deepuav/io/cameras/camera_file.h"
#include "deepuav/io/datasets/euroc_sensor.h"
#include "deepuav/io/testing/camera_checks.h"
#include "deepuav/io/testing/io_test_support.h"
#include "support/fuzzing.h"

namespace deepuav {
namespace {

class CameraFuzzTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(CameraFuzzTest, CameraFile) {
  const std::string plain(kTestCameraYaml);
  const std::string equidistant =
      "model: equidistant\nwidth: 64\nheight: 48\nfx: 45\nfy: 45\ncx: 31\ncy: 24\ndistortion: "
      "[0.01, 0.001, 0, 0]\n";
  Fuzz({plain, equidistant, "model: auto\nrate_hz: 2\n"}, 5000, [&](const std::string& input) {
    const CameraFile file = ReadCameraFile(folder_.Write("camera.yaml", input));
    if (file.has_intrinsics) CheckCamera(file.camera);
  });
}

TEST_F(CameraFuzzTest, CalibrationsOfOtherPrograms) {
  const std::string kalibr =
      "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n"
      "  distortion_coeffs: [-0.25, 0.07, 0.001, 0.002]\n  intrinsics: [45, 46, 31, 24]\n"
      "  resolution: [64, 48]\n";
  const std::string ros =
      "image_width: 64\nimage_height: 48\ncamera_matrix: {data: [45, 0, 31, 0, 46, 24, 0, 0, 1]}\n"
      "distortion_model: equidistant\ndistortion_coefficients: {data: [0.01, 0.001, 0, 0]}\n";
  const std::string orb_slam =
      "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera1.fx: 45\nCamera1.fy: 46\nCamera1.cx: 31\n"
      "Camera1.cy: 24\nCamera1.k1: -0.05\nCamera.width: 64\nCamera.height: 48\nCamera.fps: 20\n";
  Fuzz({kalibr, ros, orb_slam}, 5000, [&](const std::string& input) {
    const CameraFile file = ReadCameraFile(folder_.Write("camera.yaml", input));
    if (file.has_intrinsics) CheckCamera(file.camera);
  });
}

TEST_F(CameraFuzzTest, ColmapCameras) {
  Fuzz({"# cameras\n1 OPENCV 64 48 45 46 32 24 -0.05 0.01 0.001 0.001\n"}, 4000,
       [&](const std::string& input) {
         CheckCamera(ReadCameraFile(folder_.Write("cameras.txt", input)).camera);
       });
}

TEST_F(CameraFuzzTest, SensorFile) {
  Fuzz({std::string(kTestSensorYaml)}, 5000, [&](const std::string& input) {
    const EurocSensor sensor = ReadEurocSensor(folder_.Write("sensor.yaml", input));
    CheckCamera(sensor.camera);
    EXPECT_TRUE(sensor.body_from_cam.Matrix().allFinite());
  });
}

}  // namespace
}  // namespace deepuav
