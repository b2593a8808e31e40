#include "deepuav/io/cameras/camera_file.h"

#include <gmock/gmock.h>

#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

class CameraFileTest : public ::testing::Test {
 protected:
  CameraFile Read(const std::string& text) {
    return ReadCameraFile(folder_.Write("camera.yaml", text));
  }
  /// The message of the error, behind the file's name.
  std::string Message(const std::string& text) {
    const std::string message = ErrorOf([&] { Read(text); });
    const std::string file = (folder_.path() / "camera.yaml").string();
    EXPECT_TRUE(message.starts_with(file)) << message;
    return message.substr(std::min(file.size(), message.size()));
  }
  std::string Damaged(std::string_view from, std::string_view to) {
    return Message(Replaced(std::string(kTestCameraYaml), from, to));
  }

  TemporaryFolder folder_;
};

TEST_F(CameraFileTest, ReadsEveryField) {
  const CameraFile file = Read(std::string(kTestCameraYaml));
  EXPECT_FALSE(file.refine);
  EXPECT_TRUE(file.has_intrinsics);
  const Camera& camera = file.camera;
  EXPECT_EQ(camera.width, 64);
  EXPECT_EQ(camera.height, 48);
  EXPECT_EQ(camera.pinhole.fx, 45.5);
  EXPECT_EQ(camera.pinhole.fy, 46.5);
  EXPECT_EQ(camera.pinhole.cx, 31.25);
  EXPECT_EQ(camera.pinhole.cy, 24.75);
  EXPECT_EQ(camera.lens, LensModel::kRadialTangential);
  EXPECT_EQ(camera.distortion,
            (std::vector<double>{-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}));
  EXPECT_EQ(camera.rate_hz, 20);
}

TEST_F(CameraFileTest, ReadsTheOtherModels) {
  const std::string head = "width: 64\nheight: 48\nfx: 45\nfy: 45\ncx: 31\ncy: 24\n";
  EXPECT_EQ(Read("model: pinhole\n" + head).camera.lens, LensModel::kPinhole);
  EXPECT_EQ(Read("model: pinhole\ndistortion: []\n" + head).camera.lens, LensModel::kPinhole);
  EXPECT_EQ(Read("model: pinhole\n" + head).camera.rate_hz, 0);
  EXPECT_EQ(Read("model: equidistant\ndistortion: [0.01, 0, 0, 0]\n" + head).camera.lens,
            LensModel::kEquidistant);
  const CameraFile start = Read("model: auto\n" + head);
  EXPECT_TRUE(start.refine && start.has_intrinsics);
  EXPECT_EQ(start.camera.pinhole.fx, 45);
}

TEST_F(CameraFileTest, ReadsTheReadoutOfARollingShutter) {
  const std::string text = std::string(kTestCameraYaml);
  EXPECT_EQ(Read(text).camera.readout_s, 0);
  EXPECT_DOUBLE_EQ(Read(text + "readout_ms: 15.5\n").camera.readout_s, 0.0155);
  EXPECT_DOUBLE_EQ(Read("model: auto\nreadout_ms: 20\n").camera.readout_s, 0.02);
  EXPECT_THAT(Message(text + "readout_ms: -1\n"),
              testing::EndsWith(": readout_ms is -1: expected 0 to 1000"));
  EXPECT_THAT(Message(text + "readout_ms: 1500\n"),
              testing::EndsWith(": readout_ms is 1500: expected 0 to 1000"));
}

// The search for the fold once did not end where an inner coefficient is zero and the last is not.
TEST_F(CameraFileTest, ReadsALensWithAZeroCoefficient) {
  const std::string head = "width: 64\nheight: 48\nfx: 45\nfy: 45\ncx: 31\ncy: 24\n";
  EXPECT_EQ(
      Read("model: equidistant\ndistortion: [0.01, 0.001, 0, 0.001]\n" + head).camera.distortion[3],
      0.001);
  EXPECT_EQ(Read("model: radial_tangential\ndistortion: [0.01, 0, 0, 0, 0.001]\n" + head)
                .camera.distortion[4],
            0.001);
}

TEST_F(CameraFileTest, AutoMayLeaveEverythingToExif) {
  const CameraFile file = Read("model: auto\nrate_hz: 0.5\n");
  EXPECT_TRUE(file.refine);
  EXPECT_FALSE(file.has_intrinsics);
  EXPECT_EQ(file.camera.rate_hz, 0.5);
  const std::string path = (folder_.path() / "camera.yaml").string();
  EXPECT_EQ(ErrorOf([&] { ReadCompleteCameraFile(path); }),
            path +
                ": model is 'auto' without intrinsics, and there is no EXIF: expected width, "
                "height, fx, fy, cx, cy");
  EXPECT_EQ(
      Message("model: auto\ndistortion: [0, 0, 0, 0]\n"),
      ":2: distortion is given without width, height, fx, fy, cx and cy: expected all or none");
  EXPECT_EQ(Message("model: auto\nwidth: 64\n"), ": field 'height' is missing: expected a number");
}

TEST_F(CameraFileTest, NamesAMissingField) {
  for (const char* field :
       {"width: 64", "height: 48", "fx: 45.5", "fy: 46.5", "cx: 31.25", "cy: 24.75"}) {
    const std::string name(field, std::string_view(field).find(':'));
    EXPECT_EQ(Damaged(std::string(field) + "\n", ""),
              ": field '" + name + "' is missing: expected a number");
  }
  EXPECT_EQ(Damaged("model: radial_tangential\n", ""),
            ": field 'model' is missing: expected a word");
  EXPECT_EQ(Damaged("distortion: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n", ""),
            ": field 'distortion' is missing: expected a list of numbers");
}

TEST_F(CameraFileTest, NamesTheFieldAndLineOfAWrongValue) {
  EXPECT_EQ(Damaged("45.5", "wide"), ":4: fx is 'wide': expected a finite number");
  EXPECT_EQ(Damaged("45.5", ".nan"), ":4: fx is '.nan': expected a finite number");
  EXPECT_EQ(Damaged("45.5", "nan"), ":4: fx is 'nan': expected a finite number");
  EXPECT_EQ(Damaged("45.5", "[1, 2]"), ":4: fx is a list: expected a number");
  EXPECT_EQ(Damaged("45.5", ""), ":4: fx is empty: expected a number");
  EXPECT_EQ(Damaged("0.00019359", "inf"), ":8: distortion[2] is 'inf': expected a finite number");
  EXPECT_EQ(Damaged("[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]", "0.1"),
            ":8: distortion is '0.1': expected a list of numbers");
  EXPECT_EQ(Damaged("width: 64", "width: 64.5"),
            ":2: width is 64.5: expected a whole number from 1 to 30000");
  EXPECT_EQ(Damaged("width: 64", "width: 1e9"),
            ":2: width is 1000000000: expected a whole number from 1 to 30000");
  EXPECT_EQ(Damaged("width: 64", "width: -1"),
            ":2: width is -1: expected a whole number from 1 to 30000");
  EXPECT_EQ(Damaged("20.0", "0"), ":9: rate_hz is 0: expected more than 0");
  EXPECT_NE(Damaged("45.5", "-45.5").find("fx"), std::string::npos);
  EXPECT_NE(Damaged("31.25", "3000").find("cx"), std::string::npos);
}

TEST_F(CameraFileTest, NamesTheNumberOfCoefficients) {
  EXPECT_EQ(Damaged(", 1.76187114e-05", ""),
            ":8: distortion holds 3 coefficients: expected 4 or 5 (k1 k2 p1 p2 [k3])");
  EXPECT_EQ(Damaged("radial_tangential", "pinhole"),
            ":8: distortion holds 4 coefficients: expected none for a pinhole "
            "(radial_tangential has some)");
  EXPECT_EQ(
      Message(Replaced(Replaced(std::string(kTestCameraYaml), "radial_tangential", "equidistant"),
                       "0.00019359, ", "0.00019359, 0, ")),
      ":8: distortion holds 5 coefficients: expected 4 (k1 k2 k3 k4)");
}

TEST_F(CameraFileTest, NamesTheNearestOfAnUnknownWord) {
  EXPECT_EQ(Damaged("width", "widht"),
            ":2: unknown field 'widht': the nearest known one is 'width'");
  EXPECT_EQ(Damaged("radial_tangential", "radial_tangental"),
            ":1: model is 'radial_tangental': expected pinhole, radial_tangential, equidistant or "
            "auto (the nearest is "
            "'radial_tangential')");
}

TEST_F(CameraFileTest, NamesWhatIsNoYamlOrNoMapping) {
  EXPECT_TRUE(Damaged("[-0.28340811", "[[").starts_with(":")) << "line";
  EXPECT_NE(Damaged("0.07395907", "\"").find("is no valid YAML"), std::string::npos);
  EXPECT_EQ(Message(""), ": the file is empty: expected 'field: value' lines");
  EXPECT_EQ(Message("- 1\n- 2\n"), ":1: the file is a list: expected 'field: value' lines");
  EXPECT_EQ(Damaged("rate_hz: 20.0", "fx: 20.0"), ":9: field 'fx' is given twice");
  EXPECT_EQ(ErrorOf([] { ReadCameraFile("/nowhere/camera.yaml"); }),
            "/nowhere/camera.yaml: cannot be opened: No such file or directory");
}

}  // namespace
}  // namespace deepuav
