#include <algorithm>
#include <cmath>

#include "deepuav/io/cameras/found_camera.h"
#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

TestExif Drone() {
  TestExif exif;
  exif.model = "FC300S";
  exif.focal_length_mm = 3.61;
  exif.focal_length_35mm = 20;
  exif.latitude_deg = 28.5;
  exif.longitude_deg = -82.25;
  return exif;
}

class PhotoDatasetTest : public ::testing::Test {
 protected:
  void WritePhotograph(const std::string& name, const std::string& time, TestExif exif = Drone()) {
    exif.time = time;
    folder_.Write(name, Photograph(64, 48, 1, exif));
  }
  std::unique_ptr<Dataset> Open() { return OpenDataset(folder_.path()); }
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    const auto dataset = Open();
    for (int i = 0; i < dataset->size(); ++i)
      names.push_back(fs::path(dataset->Name(i)).filename());
    return names;
  }
  using Strings = std::vector<std::string>;

  TemporaryFolder folder_;
};

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
  folder_.Write("a.jpg", Photograph(128, 96, 1, Drone()));
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

TEST_F(PhotoDatasetTest, TheMakersCalibrationComesBeforeExif) {
  const std::string xmp =
      "http://ns.adobe.com/xap/1.0/ drone-dji:CalibratedFocalLength=\"70.5\" "
      "drone-dji:CalibratedOpticalCenterX=\"33.0\" <drone-dji:CalibratedOpticalCenterY>25.0<";
  std::string photograph = Photograph(64, 48, 1, Drone());
  const std::string segment = std::string("\xff\xe1\x00", 3) + char(xmp.size() + 2) + xmp;
  photograph.insert(2, segment);
  folder_.Write("a.jpg", photograph);
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
  folder_.Write("a.jpg", Photograph(2000, 1500, 1, Drone()));
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
  folder_.Write("d.jpg", Photograph(32, 48, 1, Drone()));
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

TEST_F(PhotoDatasetTest, FixesNeedNoCalibration) {
  TestExif exif = Drone();
  exif.model = "unknown";
  exif.focal_length_mm = 0;
  exif.focal_length_35mm = 0;
  WritePhotograph("images/b.jpg", "2018:04:29 12:06:46", exif);
  WritePhotograph("images/a.jpg", "2018:04:29 12:06:52", exif);
  const std::vector<GnssFix> fixes = ReadPhotographFixes(folder_.path());
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(SecondsBetween(fixes[0].time, fixes[1].time), 6);
  EXPECT_NEAR(fixes[1].longitude_deg, -82.25, 1e-8);
}

TEST_F(PhotoDatasetTest, AFileOfFixesBesideThemStandsForExif) {
  WritePhotograph("images/a.jpg", "2018:04:29 12:06:46", Drone());
  WritePhotograph("images/b.jpg", "2018:04:29 12:06:52", Drone());
  folder_.Write("gps.csv",
                "time [s],latitude [deg],longitude [deg],altitude [m]\n"
                "1525003606,47.1,8.5,400\n1525003607,47.2,8.5,401\n1525003608,47.3,8.5,402\n");
  const GnssStream gnss = Open()->ReadSensors().gnss;
  ASSERT_EQ(gnss.fixes.size(), 3u);
  EXPECT_GT(gnss.clock_sigma_s, 0);
  EXPECT_EQ(gnss.fixes[2].latitude_deg, 47.3);

  folder_.Write("gps.csv", "place,latitude,longitude\nhere,47.1,8.5\n");
  EXPECT_NE(Open()->ReadSensors().gnss.source.find("EXIF"), std::string::npos)
      << "fixes without times";
}

TEST_F(PhotoDatasetTest, AListOfPositionsByNameStandsForExif) {
  WritePhotograph("images/DJI_1.JPG", "2018:04:29 12:06:52", Drone());
  WritePhotograph("images/DJI_2.JPG", "2018:04:29 12:06:46", Drone());
  WritePhotograph("images/DJI_3.JPG", "2018:04:29 12:06:58", Drone());
  folder_.Write("corrected.csv",
                "Image Name,Latitude,Longitude,Altitude,Accuracy Horz,Accuracy Vert\n"
                "dji_1.jpg,47.1,8.5,400,0.02,0.03\nDJI_2.JPG,47.2,8.6,401,0.02,0.03\n"
                "DJI_9.JPG,47.3,8.6,402,0.02,0.03\n");
  folder_.Write("gps.csv", "time [s],latitude,longitude\n1525003606,10,20\n1525003607,10,20\n");
  const GnssStream gnss = Open()->ReadSensors().gnss;
  EXPECT_NE(gnss.source.find("corrected.csv"), std::string::npos);
  EXPECT_EQ(gnss.clock_sigma_s, 0);
  ASSERT_EQ(gnss.fixes.size(), 2u) << "the third is not listed: EXIF may have another origin";
  EXPECT_EQ(gnss.fixes[0].latitude_deg, 47.2);
  EXPECT_EQ(gnss.fixes[1].altitude_m, 400);
  EXPECT_EQ(gnss.fixes[1].sigma_m, Eigen::Vector3d(0.02, 0.02, 0.03));
  EXPECT_EQ(gnss.fixes[1].time, Open()->Time(1));
  EXPECT_EQ(ReadPhotographFixes(folder_.path())[0].latitude_deg, 47.2);
}

TEST_F(PhotoDatasetTest, NamesThatSeveralHaveNeedTheirFolders) {
  WritePhotograph("DCIM/100MEDIA/a.jpg", "2018:04:29 12:06:46", Drone());
  WritePhotograph("DCIM/101MEDIA/a.jpg", "2018:04:29 12:06:52", Drone());
  WritePhotograph("DCIM/101MEDIA/b.jpg", "2018:04:29 12:06:58", Drone());
  folder_.Write("geo.txt", "EPSG:4326\na.jpg 8.5 47.5\nb.jpg 8.6 47.6\n");
  std::vector<GnssFix> fixes = Open()->ReadSensors().gnss.fixes;
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].latitude_deg, 47.6);
  folder_.Write("geo.txt", "EPSG:4326\nDCIM/101MEDIA/a.jpg 8.5 47.5\nC:\\Out\\b.jpg 8.6 47.6\n");
  fixes = Open()->ReadSensors().gnss.fixes;
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(SecondsBetween(fixes[0].time, fixes[1].time), 6);
}

TEST_F(PhotoDatasetTest, ARowOfAnotherFolderTakesNoPositionAway) {
  WritePhotograph("100MEDIA/a.jpg", "2018:04:29 12:06:46", Drone());
  WritePhotograph("100MEDIA/b.jpg", "2018:04:29 12:06:52", Drone());
  folder_.Write("GCP.csv", "Name,Latitude,Longitude\npoint1,10,20\n");
  folder_.Write("list.csv",
                "image,latitude,longitude\n100MEDIA/a.jpg,47.1,8.5\n101MEDIA/a.jpg,48.1,8.5\n"
                "101MEDIA/b.jpg,48.2,8.5\n102MEDIA/b.jpg,49.2,8.5\n");
  const std::vector<GnssFix> fixes = Open()->ReadSensors().gnss.fixes;
  ASSERT_EQ(fixes.size(), 1u) << "b.jpg may be either";
  EXPECT_EQ(fixes[0].latitude_deg, 47.1);
}

TEST_F(PhotoDatasetTest, AListThatCannotBeUsedLeavesExif) {
  WritePhotograph("a.jpg", "2018:04:29 12:06:46", Drone());
  WritePhotograph("b.jpg", "2018:04:29 12:06:52", Drone());
  for (const char* list :
       {"image,latitude,longitude\nelse.jpg,47.1,8.5\n",
        "image,latitude,longitude\na.jpg,147.1,8.5\n", "EPSG:999999\na.jpg 8.5 47.1\n"}) {
    folder_.Write("list.csv", list);
    const GnssStream gnss = Open()->ReadSensors().gnss;
    EXPECT_NE(gnss.source.find("EXIF"), std::string::npos) << list;
    EXPECT_EQ(gnss.fixes.size(), 2u);
  }
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

}  // namespace
}  // namespace deepuav
