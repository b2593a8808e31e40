#include "deepuav/io/geodata/fix_table.h"

#include <gmock/gmock.h>

#include "deepuav/io/geodata/geotag_file.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/testing/io_test_support.h"

namespace deepuav {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class FixTableTest : public testing::Test {
 protected:
  GnssFix FixOf(const std::string& text) {
    return ReadGnssFile(folder_.Write("log.csv", text)).at(0);
  }
  std::string ErrorOfLog(const std::string& text) {
    const std::filesystem::path file = folder_.Write("log.csv", text);
    EXPECT_TRUE(IsGnssFile(file)) << text;
    return ErrorOf([&] { ReadGnssFile(file); });
  }
  std::string ErrorOfList(const std::string& text) {
    const std::filesystem::path file = folder_.Write("list.csv", text);
    EXPECT_TRUE(IsGeotagFile(file)) << text;
    return ErrorOf([&] { ReadGeotagFile(file); });
  }

  TemporaryFolder folder_;
};

TEST_F(FixTableTest, AnUnknownUnitIsRefused) {
  struct Case {
    const char *column, *found, *expected;
  };
  for (const Case& one : {Case{"altitude(mi)", "'mi'", "m, km, cm, mm, ft or yd"},
                          {"Altitude [dm]", "'dm'", "m, km"},
                          {"altitude (US survey ft)", "'us'", "m, km"},
                          {"height (msl) (fathom)", "'fathom'", "m, km"},
                          {"alt_miles", "'miles'", "m, km"}}) {
    EXPECT_THAT(ErrorOfLog(fmt::format("time,lat,lon,{}\n1,47,8,100\n", one.column)),
                AllOf(HasSubstr("log.csv: column '" + LowerCase(one.column) + "' is in "),
                      HasSubstr(one.found), HasSubstr(std::string("expected ") + one.expected)));
    EXPECT_THAT(ErrorOfList(fmt::format("image,lat,lon,{}\na.jpg,47,8,100\n", one.column)),
                AllOf(HasSubstr("list.csv: column "), HasSubstr(one.found)));
  }
  for (const char* head : {"time,latitude(rad),longitude", "time,latitude,longitude [gon]",
                           "time,latitude_rad,longitude_rad", "time,latitude(W),longitude"}) {
    EXPECT_THAT(ErrorOfLog(std::string(head) + "\n1,0.82,0.14\n"),
                AllOf(HasSubstr("log.csv: column '"), HasSubstr("expected degrees")));
  }
}

TEST_F(FixTableTest, WhatInBracketsIsNoUnitIsLetBe) {
  for (const char* altitude : {"altitude (AMSL)", "altitude [m AMSL]", "altitude (above sea level)",
                               "height (ellipsoidal)", "alt (WGS84)", "altitude (EGM2008 m)",
                               "height(NAVD88)", "altitude (m) [WGS 84]"}) {
    EXPECT_EQ(FixOf(fmt::format("time,lat,lon,{}\n1,47,8,100\n", altitude)).altitude_m, 100)
        << altitude;
  }
  for (const char* altitude : {"altitude (MSL ft)", "height (ellipsoidal) [ft]", "alt_ft (amsl)"}) {
    EXPECT_DOUBLE_EQ(
        FixOf(fmt::format("time,lat,lon,{}\n1,47,8,100\n", altitude)).altitude_m.value_or(0), 30.48)
        << altitude;
  }
  for (const char* position :
       {"latitude (deg),longitude (deg)", "lat[degrees],lon[degrees]", "lat (°),lon (°)",
        "Latitude (WGS84),Longitude (WGS84)", "lat (decimal degrees),lon (decimal degrees)",
        "latitude (N),longitude (E)", "lat_gps,lon_gps"}) {
    EXPECT_EQ(FixOf(fmt::format("time,{}\n1,47,8\n", position)).longitude_deg, 8) << position;
  }
}

TEST_F(FixTableTest, EveryAccuracyHasItsOwnUnit) {
  const GnssFix fix = FixOf("time,lat,lon,alt,sde(cm),sdn(m),sdu(mm)\n1,47,8,100,2,3,5\n");
  EXPECT_EQ(fix.sigma_m, Eigen::Vector3d(0.02, 3, 0.005));
}

TEST_F(FixTableTest, ADecimalCommaIsNamed) {
  for (const char* text :
       {"time;lat;lon\n1;47,39;8,54\n", "1;47,39;8,54\n", "1,5;47,39;8,54\n",
        "time\tlat\tlon\n1\t47,39\t8,54\n", "time,lat,lon\n1,\"47,39\",\"8,54\"\n"}) {
    EXPECT_THAT(ErrorOfLog(text), AllOf(HasSubstr("log.csv:"), HasSubstr("decimal point"))) << text;
  }
  for (const char* text : {"image;lat;lon\na.jpg;47,39;8,54\n", "a.jpg;47,39;8,54\n",
                           "EPSG:4326\na.jpg 8,54 47,39\n"}) {
    EXPECT_THAT(ErrorOfList(text), AllOf(HasSubstr("'47,39'"), HasSubstr("decimal point"))) << text;
  }
}

TEST_F(FixTableTest, AQuoteWithoutEndIsRefused) {
  for (const char* text : {"time,lat,lon\n1,\"47,8\n", "time,lat,lon\n1,47\",8\n", "1,\"47,8\n",
                           "time,\"lat,lon\n1,47,8\n"}) {
    EXPECT_THAT(ErrorOfLog(text), AllOf(HasSubstr("log.csv"), HasSubstr("quote has no other end")))
        << text;
  }
  EXPECT_THAT(ErrorOfList("image,lat,lon\n\"a.jpg,47,8\n"),
              AllOf(HasSubstr("list.csv:2"), HasSubstr("quote has no other end")));
}

TEST(SplitRow, KeepsSeparatorsWithinQuotes) {
  TableRow fields;
  EXPECT_TRUE(SplitRow("1, \"a, b\" ,\"\",c", &fields));
  EXPECT_THAT(fields, ElementsAre("1", "a, b", "", "c"));
  EXPECT_TRUE(SplitRow("\"a; b\",2", &fields));
  EXPECT_THAT(fields, ElementsAre("a; b", "2"));
  EXPECT_TRUE(SplitRow("\"say \"\"a\"\", b\",2", &fields));
  EXPECT_THAT(fields, ElementsAre("say \"\"a\"\", b", "2"));
  EXPECT_TRUE(SplitRow("5\" pipe,2", &fields));
  EXPECT_THAT(fields, ElementsAre("5\" pipe", "2"));
  EXPECT_TRUE(SplitRow("a\t\t\"b\"", &fields));
  EXPECT_THAT(fields, ElementsAre("a", "", "b"));
  EXPECT_TRUE(SplitRow("", &fields));
  EXPECT_THAT(fields, ElementsAre(""));
  EXPECT_FALSE(SplitRow("\"a,b", &fields));
  EXPECT_THAT(fields, ElementsAre("a", "b"));
}

}  // namespace
}  // namespace deepuav
