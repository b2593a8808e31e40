#include "deepuav/assembly/output/found_calibration.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

FoundCalibration Found(const RefinedLens& lens) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.pinhole = {500, 500, 319.5, 239.5};
  camera.lens = LensModel::kRadialTangential;
  camera.distortion = {-0.1, 0, 0, 0};
  return DescribeCalibration(camera, "a guess", camera, lens);
}

TEST(RefinedBy, KeepsWhatARunDoesNotTell) {
  SlamResult result;
  Camera camera;
  camera.readout_s = 0.019;
  EXPECT_FALSE(RefinedBy(result, camera, std::nullopt));
  RefinedLens before;
  before.readout_s = 0.021;
  before.sigmas = {.focal = 0.01, .k1 = 0.02, .readout_s = 0.002};
  EXPECT_EQ(RefinedBy(result, camera, before)->sigmas.focal, 0.01);
  result.lens = CalibrationSigmas{.focal = 0.001, .k1 = 0.002};
  const auto by_lens = RefinedBy(result, camera, before);
  EXPECT_EQ(by_lens->sigmas.focal, 0.001);
  EXPECT_EQ(by_lens->readout_s, 0.021);
  EXPECT_EQ(by_lens->sigmas.readout_s, 0.002);
  result.readout = FoundReadout{.change_s = -0.002, .sigma_s = 0.0001};
  const auto by_both = RefinedBy(result, camera, before);
  EXPECT_EQ(by_both->sigmas.k1, 0.002);
  EXPECT_EQ(by_both->readout_s, 0.019);
  EXPECT_EQ(by_both->sigmas.readout_s, 0.0001);
}

TEST(RefinedBy, AReadoutAloneIsALensToTellOf) {
  SlamResult result;
  result.readout = FoundReadout{.change_s = 0.02, .sigma_s = 0.0001};
  Camera camera;
  camera.readout_s = 0.02;
  const auto lens = RefinedBy(result, camera, std::nullopt);
  ASSERT_TRUE(lens);
  EXPECT_EQ(lens->readout_s, 0.02);
  EXPECT_EQ(lens->sigmas.focal, 0);
}

TEST(CalibrationText, SaysHowWellTheFocalLengthIsKnown) {
  RefinedLens lens;
  lens.sigmas.focal = 0.00012;
  lens.sigmas.k1 = 0.0004;
  EXPECT_EQ(CalibrationText(Found(lens)),
            "focal length 500.0 px (standard deviation 0.06), k1 -0.1000 (0.0004); from a guess\n");
  EXPECT_NE(CalibrationYaml(Found(lens)).find("fx 0.060 px"), std::string::npos);
}

TEST(CalibrationText, SaysWhereNothingToldTheFocalLength) {
  RefinedLens lens;
  lens.is_focal_told = false;
  lens.sigmas.focal = 0.3;
  lens.sigmas.k1 = 0.0004;
  EXPECT_EQ(CalibrationText(Found(lens)),
            "focal length 500.0 px, which the photographs don't tell, k1 -0.1000 (0.0004); from a "
            "guess\n");
  EXPECT_EQ(CalibrationYaml(Found(lens)).find("fx 150"), std::string::npos);
}

TEST(CalibrationYaml, KeepsTheReadoutOfARollingShutter) {
  Camera camera = Found({}).camera;
  EXPECT_EQ(CalibrationYaml(DescribeCalibration(camera, "a file", camera, {})).find("readout_ms"),
            std::string::npos);
  camera.readout_s = 0.0183;
  const FoundCalibration told = DescribeCalibration(camera, "a file", camera, {});
  EXPECT_NE(CalibrationYaml(told).find("\nreadout_ms: 18.3\n"), std::string::npos);
  EXPECT_EQ(CalibrationText(told).find("rolling"), std::string::npos) << "nothing new";
  RefinedLens lens;
  lens.readout_s = 0.0183;
  lens.sigmas.readout_s = 0.0002;
  const FoundCalibration found = DescribeCalibration(camera, "a file", camera, lens);
  EXPECT_NE(CalibrationYaml(found).find("0.0183 s from the first row to the last"),
            std::string::npos);
  EXPECT_NE(CalibrationText(found).find("rolling shutter 18.3 ms"), std::string::npos);
}

}  // namespace
}  // namespace deepuav
