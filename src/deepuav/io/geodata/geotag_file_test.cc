#include "deepuav/io/geodata/geotag_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/grid_coordinates.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

using testing::AllOf;
using testing::HasSubstr;
namespace fs = std::filesystem;

class GeotagFileTest : public testing::Test {
 protected:
  std::vector<Geotag> Read(const std::string& text) {
    const fs::path file = folder_.Write("list.txt", text);
    EXPECT_TRUE(IsGeotagFile(file)) << text;
    return ReadGeotagFile(file);
  }
  std::string ErrorOf(const std::string& text) {
    return deepuav::ErrorOf([&] { ReadGeotagFile(folder_.Write("list.txt", text)); });
  }

  TemporaryFolder folder_;
};

TEST_F(GeotagFileTest, ReadsTablesByTheirHeads) {
  struct Case {
    const char* text;
    Eigen::Vector3d sigma_m;
  };
  const Case cases[] = {
      {"image,latitude,longitude,altitude\na.jpg,47.5,8.25,440.5\n", {0, 0, 0}},
      // Metashape's reference.
      {"# CoordinateSystem: GEOGCS[\"WGS 84\",DATUM[...]]\n"
       "#Label,X/Longitude,Y/Latitude,Z/Altitude,Yaw,Pitch,Roll,Accuracy_X/Y_(m),Accuracy_Z_(m)\n"
       "a.jpg,8.25,47.5,440.5,10,20,30,0.02,0.03\n",
       {0.02, 0.02, 0.03}},
      // Pix4D's, with a head.
      {"imagename,latitude,longitude,altitude,omega,phi,kappa,accuracy_horizontal,"
       "accuracy_vertical\na.jpg,47.5,8.25,440.5,1,2,3,.02,.03\n",
       {0.02, 0.02, 0.03}},
      // As RTKLIB names standard deviations; tabs.
      {"Photo\tlatitude(deg)\tlongitude(deg)\theight(m)\tsdn(m)\tsde(m)\tsdu(m)\n"
       "a.jpg\t47.5\t8.25\t440.5\t.01\t.02\t.03\n",
       {0.02, 0.01, 0.03}},
      {"\"File Name\";\"Lateral RMS (m)\";\"Latitude\";\"Longitude\";\"Relative altitude\";"
       "\"Ellipsoidal height (ft)\"\n\"a.jpg\";0.5;47.5;8.25;30;1445.2099738\n",
       {0.5, 0.5, 0}},
  };
  for (const Case& one : cases) {
    const std::vector<Geotag> tags = Read(one.text);
    ASSERT_EQ(tags.size(), 1u) << one.text;
    EXPECT_EQ(tags[0].image, "a.jpg");
    EXPECT_EQ(tags[0].fix.latitude_deg, 47.5) << one.text;
    EXPECT_EQ(tags[0].fix.longitude_deg, 8.25) << one.text;
    EXPECT_NEAR(tags[0].fix.altitude_m.value_or(0), 440.5, 1e-6) << one.text;
    EXPECT_EQ(tags[0].fix.sigma_m, one.sigma_m) << one.text;
  }
}

TEST_F(GeotagFileTest, WithoutAHeadLatitudeIsFirst) {
  const std::vector<Geotag> tags = Read("a.jpg,47.5,8.25,440.5\nb.jpg,47.6,8.26\n");
  ASSERT_EQ(tags.size(), 2u);
  EXPECT_EQ(tags[0].fix.latitude_deg, 47.5);
  EXPECT_EQ(tags[0].fix.altitude_m, 440.5);
  EXPECT_FALSE(tags[1].fix.altitude_m);
}

TEST_F(GeotagFileTest, ReadsListsOfOpenDroneMap) {
  const std::vector<Geotag> tags = Read(
      "EPSG:4326\na.JPG 8.25 47.5 440.5\nb.JPG 8.26 47.6 441 10 0 20 0.02 0.03\n"
      "c.JPG 8.27 47.7\n");
  ASSERT_EQ(tags.size(), 3u);
  EXPECT_EQ(tags[0].fix.latitude_deg, 47.5);
  EXPECT_EQ(tags[0].fix.longitude_deg, 8.25);
  EXPECT_EQ(tags[0].fix.altitude_m, 440.5);
  EXPECT_EQ(tags[0].fix.sigma_m, Eigen::Vector3d::Zero());
  EXPECT_EQ(tags[1].fix.sigma_m, Eigen::Vector3d(0.02, 0.02, 0.03));
  EXPECT_FALSE(tags[2].fix.altitude_m);
}

TEST_F(GeotagFileTest, GridsAreTurnedIntoLatitudeAndLongitude) {
  const GeoPoint expected = GeoFromUtm({32, true}, {400000, 5262000, 0});
  for (const char* system : {"WGS84 UTM 32N", "EPSG:32632", "EPSG:25832",
                             "+proj=utm +zone=32 +datum=WGS84 +units=m +no_defs"}) {
    const Geotag tag = Read(std::string(system) + "\na.jpg 400000 5262000 440\n")[0];
    EXPECT_NEAR(tag.fix.longitude_deg, expected.longitude_deg, 1e-8) << system;
    EXPECT_NEAR(tag.fix.latitude_deg, expected.latitude_deg, 1e-8) << system;
    EXPECT_EQ(tag.fix.altitude_m, 440);
  }
  const GeoPoint sydney = GeoFromUtm({56, false}, {334368, 6250948, 0});
  const Geotag south = Read("WGS84 UTM 56S\na.jpg 334368 6250948\n")[0];
  EXPECT_NEAR(south.fix.latitude_deg, sydney.latitude_deg, 1e-8);
  // The origin of the Swiss grid, the old observatory of Bern, on CH1903+; some 130 m off on
  // WGS 84.
  const Geotag bern = Read("EPSG:2056\na.jpg 2600000 1200000\n")[0];
  EXPECT_NEAR(bern.fix.latitude_deg, 46 + 57 / 60.0 + 8.66 / 3600, 2e-3);
  EXPECT_NEAR(bern.fix.longitude_deg, 7 + 26 / 60.0 + 22.50 / 3600, 2e-3);
}

TEST_F(GeotagFileTest, OtherTablesAreNone) {
  for (const char* text :
       {"", "time [s],latitude,longitude\n1,47,8\n", "image,time\na.jpg,12\n", "1 0 0 0 a.jpg\n",
        "a.jpg is the first of 8.25 47.5\n", "EPSG:4326\n", "EPSG:4326\nnotes 8 47\n"}) {
    EXPECT_FALSE(IsGeotagFile(folder_.Write("list.txt", text))) << text;
    EXPECT_THAT(ErrorOf(text), HasSubstr("lists no position")) << text;
  }
}

TEST_F(GeotagFileTest, RowsWithoutPositionAreLeftOut) {
  EXPECT_EQ(
      Read("image,latitude,longitude\na.jpg,,\nb.jpg,nan,nan\nc.jpg,0,0\nd.jpg,47,8\n").size(), 1u);
}

TEST_F(GeotagFileTest, ErrorsNameTheLine) {
  EXPECT_THAT(ErrorOf("image,latitude,longitude\na.jpg,47,8\nb.jpg,north,8\n"),
              AllOf(HasSubstr("list.txt:3"), HasSubstr("latitude is 'north'")));
  EXPECT_THAT(ErrorOf("image,latitude,longitude\na.jpg,97,8\n"),
              AllOf(HasSubstr("list.txt:2"), HasSubstr("-90 to 90")));
  EXPECT_THAT(ErrorOf("image,latitude,longitude\na.jpg,47\n"), HasSubstr("2 fields"));
  EXPECT_THAT(ErrorOf("EPSG:999999\na.jpg 8 47\n"),
              AllOf(HasSubstr("list.txt:1"), HasSubstr("no known reference system")));
  EXPECT_THAT(ErrorOf("EPSG:32632\na.jpg 1e30 1e30\n"), HasSubstr("is no point of EPSG:32632"));
}

TEST_F(GeotagFileTest, TablesBesideAreFoundByFolderAndName) {
  using testing::ElementsAre;
  using testing::IsEmpty;
  const char* list = "image,latitude,longitude\na.jpg,47,8\n";
  const fs::path above = folder_.path(), images = folder_.path() / "images";
  EXPECT_THAT(FindGeotagsBeside({above}), IsEmpty());
  folder_.Write("z.csv", list);
  folder_.Write("notes.txt", "sunny\n");
  fs::create_symlink("loop.csv", above / "loop.csv");
  folder_.Write("B.TXT", list);
  EXPECT_THAT(FindGeotagsBeside({above, above}), ElementsAre(above / "B.TXT", above / "z.csv"));
  folder_.Write("images/z.csv", list);
  EXPECT_THAT(FindGeotagsBeside({images, above}),
              ElementsAre(images / "z.csv", above / "B.TXT", above / "z.csv"));
}

TEST_F(GeotagFileTest, NoFileOrAddressIsOpenedForAReferenceSystem) {
  for (const char* system :
       {"http://127.0.0.1:1/x", "/etc/passwd", "wgs84.prj", "+init=/tmp/grid:1",
        "+proj=longlat +ellps=GRS80 +nadgrids=/tmp/grid +no_defs", "WGS84 UTM 61N"}) {
    const std::string text = "#EPSG:4326\n#a.jpg 8 47\n" + std::string(system) + "\nb.jpg 8 47\n";
    EXPECT_NE(ErrorOf(text), "") << system;
    EXPECT_THROW(GridCoordinates(system, "here"), Error) << system;
  }
  EXPECT_EQ(Read("# EPSG:32632\n# of today\nEPSG:4326\na.jpg 8 47\n")[0].fix.latitude_deg, 47);
}

TEST_F(GeotagFileTest, WhatStandsBeforeTheHeadIsNoRow) {
  EXPECT_EQ(Read("sep=,\nimage_id,image_name,latitude,longitude\n7,a.jpg,47,8\n")[0].image,
            "a.jpg");
  EXPECT_EQ(Read("# my list\na.jpg,47,8\n").size(), 1u);
}

}  // namespace
}  // namespace deepuav
