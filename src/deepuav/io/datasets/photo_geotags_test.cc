#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/testing/photo_dataset_fixture.h"

namespace deepuav {
namespace {

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

}  // namespace
}  // namespace deepuav
