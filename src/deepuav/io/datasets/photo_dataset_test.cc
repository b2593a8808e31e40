#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/testing/photo_dataset_fixture.h"

namespace deepuav {
namespace {

TEST_F(PhotoDatasetTest, CameraAndFixComeFromExif) {
  WritePhotograph("images/a.JPG", "2018:04:29 12:06:46");
  WritePhotograph("images/b.jpeg", "2018:04:29 12:06:52");
  const auto dataset = Open();
  EXPECT_EQ(dataset->Kind(), "photographs");
  ASSERT_EQ(dataset->size(), 2);
  EXPECT_TRUE(dataset->CalibrationIsApproximate());
  const Camera& camera = dataset->camera();
  EXPECT_NEAR(camera.pinhole.fx, 80 * 20.0 / std::hypot(36, 24), 1e-3);
  EXPECT_EQ(camera.pinhole.fy, camera.pinhole.fx);
  EXPECT_EQ(camera.pinhole.cx, 31.5);
  EXPECT_EQ(camera.pinhole.cy, 23.5);
  EXPECT_EQ(camera.lens, LensModel::kPinhole);
  EXPECT_NEAR(camera.rate_hz, 1 / 6.0, 1e-12);
  EXPECT_EQ(dataset->Time(0).nanoseconds, 1525003606000000000);
  EXPECT_EQ(SecondsBetween(dataset->Time(0), dataset->Time(1)), 6);
  const GnssStream gnss = dataset->ReadSensors().gnss;
  ASSERT_EQ(gnss.fixes.size(), 2u);
  EXPECT_EQ(gnss.clock_sigma_s, 0);
  EXPECT_EQ(gnss.fixes[1].time, dataset->Time(1));
  EXPECT_NEAR(gnss.fixes[1].longitude_deg, -82.25, 1e-8);
  EXPECT_FALSE(gnss.fixes[1].altitude_m);
  EXPECT_EQ(dataset->Load(0).size(), cv::Size(64, 48));
}

TEST_F(PhotoDatasetTest, AreInOrderOfTime) {
  WritePhotograph("a.jpg", "2018:04:29 12:06:52");
  WritePhotograph("b.jpg", "2018:04:29 12:06:46");
  EXPECT_EQ(Names(), (Strings{"b.jpg", "a.jpg"}));
}

TEST_F(PhotoDatasetTest, AreInOrderOfNameOneASecondWhereTimesAreMissingOrAllAreTheSame) {
  WritePhotograph("img_10.jpg", "2018:04:29 12:06:46");
  WritePhotograph("img_9.jpg", "");
  WritePhotograph("img_11.jpg", "");
  EXPECT_EQ(Names(), (Strings{"img_9.jpg", "img_10.jpg", "img_11.jpg"}));
  EXPECT_EQ(Open()->Time(1).nanoseconds, 1000000000);
  EXPECT_EQ(Open()->camera().rate_hz, 1);
  WritePhotograph("img_9.jpg", "2018:04:29 12:06:46");
  WritePhotograph("img_11.jpg", "2018:04:29 12:06:46");
  EXPECT_EQ(Names(), (Strings{"img_9.jpg", "img_10.jpg", "img_11.jpg"}));
  EXPECT_EQ(Open()->Time(0).nanoseconds, 0);
}

TEST_F(PhotoDatasetTest, TheFewWithoutATimeFollowThoseBeforeThemByName) {
  WritePhotograph("a.jpg", "2018:04:29 12:06:46");
  folder_.Write("b.jpg", "not a photograph");
  WritePhotograph("c.jpg", "2018:04:29 12:06:52");
  folder_.Write("d.png", PngPhotograph(64, 48, 1, TestExif{}));
  WritePhotograph("e.jpg", "2018:04:29 12:06:49");
  EXPECT_EQ(Names(), (Strings{"a.jpg", "b.jpg", "e.jpg", "c.jpg", "d.png"}));
  const auto dataset = Open();
  const double expected_s[] = {0, 0.5, 3, 6, 6.5};
  for (int i = 0; i < dataset->size(); ++i)
    EXPECT_EQ(SecondsBetween(dataset->Time(0), dataset->Time(i)), expected_s[i]) << i;
}

TEST_F(PhotoDatasetTest, PhotographsOfOneSecondShareItByName) {
  WritePhotograph("img_9.jpg", "2018:04:29 12:06:46");
  WritePhotograph("img_10.jpg", "2018:04:29 12:06:46");
  WritePhotograph("img_11.jpg", "2018:04:29 12:06:47");
  WritePhotograph("img_8.jpg", "2018:04:29 12:06:44");
  WritePhotograph("img_12.jpg", "2018:04:29 12:06:47");
  EXPECT_EQ(Names(), (Strings{"img_8.jpg", "img_9.jpg", "img_10.jpg", "img_11.jpg", "img_12.jpg"}));
  const auto dataset = Open();
  const double expected_s[] = {0, 2, 2.5, 3, 3.5};
  for (int i = 0; i < dataset->size(); ++i) {
    EXPECT_EQ(SecondsBetween(dataset->Time(0), dataset->Time(i)), expected_s[i]) << i;
  }
}

TEST_F(PhotoDatasetTest, ATimeOfMoreThanACameraTakesInASecondIsNotBelieved) {
  for (int i = 0; i < 31; ++i) {
    WritePhotograph(fmt::format("img_{}.jpg", i), "2018:04:29 12:06:46");
  }
  WritePhotograph("img_31.jpg", "2018:04:29 12:06:47");
  EXPECT_EQ(Open()->Time(31).nanoseconds, 31000000000);
}

TEST_F(PhotoDatasetTest, ACameraFileOverridesExif) {
  WritePhotograph("a.jpg", "");
  folder_.Write("camera.yaml", kTestCameraYaml);
  EXPECT_EQ(Open()->camera().pinhole.fx, 45.5);
  EXPECT_FALSE(Open()->CalibrationIsApproximate());
  folder_.Write("camera.yaml", "model: auto\nrate_hz: 2\n");
  EXPECT_NEAR(Open()->camera().pinhole.fx, 80 * 20.0 / std::hypot(36, 24), 1e-3);
  EXPECT_EQ(Open()->camera().rate_hz, 2);
  EXPECT_TRUE(Open()->CalibrationIsApproximate());
  folder_.Write("camera.yaml", Replaced(std::string(kTestCameraYaml), "width: 64", "width: 80"));
  EXPECT_EQ(ErrorOf([&] { Open(); }),
            (folder_.path() / "a.jpg").string() + ": image is 64x48: expected 80x48 as in " +
                (folder_.path() / "camera.yaml").string() + ", or the same proportions");
}

TEST_F(PhotoDatasetTest, ACalibrationOfAnotherSizeIsScaled) {
  folder_.Write("a.jpg", JpegPhotograph(128, 96, 1, Drone()));
  folder_.Write("camera.yaml", kTestCameraYaml);
  const Camera camera = Open()->camera();
  EXPECT_EQ(camera.width, 128);
  EXPECT_EQ(camera.pinhole.fx, 91);
  EXPECT_EQ(camera.pinhole.cx, 2 * 31.75 - 0.5);
}

TEST_F(PhotoDatasetTest, WithoutFocalLengthAGuessIsSaidToBeOne) {
  folder_.Write("a.png", EncodedImage(64, 48, 1, ".png"));
  const auto dataset = Open();
  EXPECT_TRUE(dataset->CalibrationIsApproximate());
  EXPECT_EQ(dataset->Calibration().text, "a guess");
  EXPECT_GT(dataset->Calibration().focal_sigma, 0.3);
  EXPECT_GT(dataset->camera().pinhole.fx, 32);
  EXPECT_LT(dataset->camera().pinhole.fx, 128);
}

std::string WithXmp(const std::string& xmp, const TestExif& exif = Drone()) {
  std::string photograph = JpegPhotograph(64, 48, 1, exif);
  const std::string segment = std::string("\xff\xe1\x00", 3) + char(xmp.size() + 2) + xmp;
  return photograph.insert(2, segment);
}

TEST_F(PhotoDatasetTest, TheMakersCalibrationComesBeforeExif) {
  const std::string xmp =
      "http://ns.adobe.com/xap/1.0/ drone-dji:CalibratedFocalLength=\"70.5\" "
      "drone-dji:CalibratedOpticalCenterX=\"33.0\" <drone-dji:CalibratedOpticalCenterY>25.0<";
  folder_.Write("a.jpg", WithXmp(xmp));
  const auto dataset = Open();
  EXPECT_EQ(dataset->Calibration().text, "XMP calibrated");
  EXPECT_EQ(dataset->camera().pinhole.fx, 70.5);
  EXPECT_EQ(dataset->camera().pinhole.cx, 33);
  EXPECT_EQ(dataset->camera().pinhole.cy, 25);
  EXPECT_EQ(dataset->Load(0).size(), cv::Size(64, 48));
}

TEST_F(PhotoDatasetTest, AMakersCalibrationThatCannotBeIsNotBelieved) {
  const cv::Size size(4000, 3000);
  for (const std::string text :
       {"drone-dji:CalibratedFocalLength=\"0\"", "drone-dji:CalibratedFocalLength=\"nan\"",
        "drone-dji:CalibratedFocalLength=\"1e9\"",
        "drone-dji:CalibratedFocalLength=", "drone-dji"}) {
    EXPECT_FALSE(CameraFromMetadata(ParseXmpLens(text), {}, size)) << text;
  }
  // Of a photograph that was reduced to a quarter since.
  const auto reduced = CameraFromMetadata(XmpLens{3600, 2000, 1500}, {}, cv::Size(1000, 750));
  ASSERT_TRUE(reduced);
  EXPECT_NEAR(reduced->camera.pinhole.fx, 900, 1);
}

TEST_F(PhotoDatasetTest, LargeImagesAreWorkedOnReduced) {
  folder_.Write("a.jpg", JpegPhotograph(2000, 1500, 1, Drone()));
  const auto dataset = Open();
  EXPECT_EQ(dataset->stored_camera().width, 2000);
  const Camera& camera = dataset->camera();
  EXPECT_NEAR(camera.width * camera.height, 1e6, 2e3);
  EXPECT_EQ(dataset->Load(0).size(), cv::Size(camera.width, camera.height));
  EXPECT_NEAR(camera.pinhole.fx / camera.width, dataset->stored_camera().pinhole.fx / 2000, 1e-9);
  EXPECT_NEAR(camera.pinhole.cx, (camera.width - 1) / 2.0, 1e-9);
  DatasetOptions options;
  options.working_pixels = 0;
  EXPECT_EQ(OpenDataset(folder_.path(), options)->Load(0).size(), cv::Size(2000, 1500));
}

TEST_F(PhotoDatasetTest, AreFoundInSubFoldersButNotInHiddenOnes) {
  WritePhotograph("DCIM/100MEDIA/DJI_0002.JPG", "2018:04:29 12:06:52");
  WritePhotograph("DCIM/101MEDIA/DJI_0001.JPG", "2018:04:29 12:06:58");
  WritePhotograph("DCIM/.thumbnails/DJI_0002.JPG", "2018:04:29 12:06:52");
  EXPECT_EQ(Names(), (Strings{"DJI_0002.JPG", "DJI_0001.JPG"}));
}

TEST_F(PhotoDatasetTest, OfMixedSizesAndCamerasTheMostAreTaken) {
  WritePhotograph("a.jpg", "");
  WritePhotograph("b.jpg", "");
  WritePhotograph("c.jpg", "");
  folder_.Write("d.jpg", JpegPhotograph(32, 48, 1, Drone()));
  TestExif other = Drone();
  other.model = "FC6310";
  WritePhotograph("e.jpg", "", other);
  EXPECT_EQ(Names(), (Strings{"a.jpg", "b.jpg", "c.jpg"}));
}

TEST_F(PhotoDatasetTest, AHeaderThatClaimsToBeHugeLeavesOutItsFileOnly) {
  WritePhotograph("a.jpg", "");
  WritePhotograph("b.jpg", "");
  std::string png = EncodedImage(64, 48, 1, ".png");
  png[18] = png[22] = 0x75;  // 30,000 x 30,000
  png[19] = png[23] = 0x30;
  folder_.Write("c.png", png);
  EXPECT_EQ(Names(), (Strings{"a.jpg", "b.jpg"}));
}

TEST_F(PhotoDatasetTest, GimbalAnglesAreOfTheFramesThatHaveThem) {
  const auto angles = [](const std::string& yaw, const TestExif& exif = Drone()) {
    return WithXmp(
        "http://ns.adobe.com/xap/1.0/ drone-dji:GimbalYawDegree=\"" + yaw +
            "\" drone-dji:GimbalPitchDegree=\"-90.0\" drone-dji:GimbalRollDegree=\"0.0\"",
        exif);
  };
  folder_.Write("a.jpg", angles("+90.0"));
  WritePhotograph("b.jpg", "");
  folder_.Write("c.jpg", angles("+180.0"));
  TestExif portrait = Drone();
  portrait.orientation = 6;
  folder_.Write("d.jpg", angles("+180.0", portrait));
  const auto dataset = Open();
  const AttitudeStream attitude = dataset->ReadSensors().attitude;
  ASSERT_EQ(attitude.samples.size(), 2u);
  EXPECT_NE(attitude.source.find("XMP"), std::string::npos);
  EXPECT_EQ(attitude.samples[1].time, dataset->Time(2));
  const Eigen::Vector3d top = attitude.samples[1].enu_from_cam * -Eigen::Vector3d::UnitY();
  EXPECT_LT((top - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12) << top.transpose();  // South.
}

TEST_F(PhotoDatasetTest, ADamagedPhotographFailsOnlyItself) {
  WritePhotograph("a.jpg", "");
  folder_.Write("b.jpg", "not a photograph");
  WritePhotograph("c.jpg", "");
  const auto dataset = Open();
  ASSERT_EQ(dataset->size(), 3);
  EXPECT_NE(ErrorOf([&] { dataset->Load(1); }).find("b.jpg"), std::string::npos);
  EXPECT_EQ(dataset->Load(2).size(), cv::Size(64, 48));
}

TEST_F(PhotoDatasetTest, ReadsPngAndTiffToo) {
  TestExif exif = Drone();
  folder_.Write("a.png", PngPhotograph(64, 48, 1, exif));
  folder_.Write("b.tif", EncodedImage(64, 48, 1, ".tif"));
  folder_.Write(".hidden.jpg", "x");
  const auto dataset = Open();
  ASSERT_EQ(dataset->size(), 2);
  const GnssStream gnss = dataset->ReadSensors().gnss;
  ASSERT_EQ(gnss.fixes.size(), 1u);
  EXPECT_EQ(gnss.fixes[0].time, dataset->Time(0));
  EXPECT_EQ(dataset->Load(1).size(), cv::Size(64, 48));
}

TEST_F(PhotoDatasetTest, ReadsWebpAndBmpAndWhatThermalCamerasWrite) {
  const std::string jpeg = EncodedImage(64, 48, 1, ".jpg");
  const cv::Mat picture = cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), 0);
  const auto write = [&](const char* name, const cv::Mat& image) {
    ASSERT_TRUE(cv::imwrite(folder_.path() / name, image)) << name;
  };
  write("a.webp", picture);
  write("b.bmp", picture);
  cv::Mat kelvin, counts;
  picture.convertTo(kelvin, CV_32F, 0.05, 280);
  write("c.tif", kelvin);
  picture.convertTo(counts, CV_16U, 20, 7000);
  write("d.tiff", counts);
  const auto dataset = Open();
  ASSERT_EQ(dataset->size(), 4);
  for (int i = 0; i < 4; ++i) {
    const GreyImage image = dataset->Load(i);
    ASSERT_EQ(image.size(), picture.size()) << i;
    cv::Scalar mean, deviation, of_picture;
    cv::meanStdDev(image, mean, deviation);
    cv::meanStdDev(picture, mean, of_picture);
    EXPECT_GT(deviation[0], 0.8 * of_picture[0]) << "nothing to see in image " << i;
  }
}

}  // namespace
}  // namespace deepuav
