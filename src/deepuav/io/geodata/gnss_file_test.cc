#include "deepuav/io/geodata/gnss_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/iso_time.h"

namespace deepuav {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class GnssFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("deepuav_gnss_file_test_") +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string ErrorOf(const std::string& name, const std::string& text) {
    const std::filesystem::path file = Write(name, text);
    try {
      ReadGnssFile(file);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

TEST_F(GnssFileTest, ReadsTheSimulatorsHead) {
  const auto file = Write("data.csv",
                          "#timestamp [ns],latitude [deg],longitude [deg],altitude [m],sigma [m]\n"
                          "1403636584763555584,47.5,8.25,440.5,1.2\n"
                          "1403636584963555585,47.6,8.26,441,1.2\n");
  EXPECT_TRUE(IsGnssFile(file));
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[1].time.nanoseconds, 1403636584963555585);
  EXPECT_EQ(fixes[0].latitude_deg, 47.5);
  EXPECT_EQ(fixes[0].longitude_deg, 8.25);
  EXPECT_EQ(fixes[0].altitude_m, 440.5);
}

TEST_F(GnssFileTest, ColumnsAreToldByTheirNames) {
  const GnssFix fix = ReadGnssFile(Write(
      "log.csv",
      "time [s],lat,lon,baroaltitude,height,stdEast,stdNorth,stdUp,velocity accuracy vertical\n"
      "1,47,8,900,500,1,2,3,9\n"))[0];
  EXPECT_EQ(fix.altitude_m, 500);
  EXPECT_EQ(fix.sigma_m, Eigen::Vector3d(1, 2, 3));
  const GnssFix other = ReadGnssFile(Write(
      "other.csv", "time,lat,lon,std_lat(deg),accuracy_horizontal (mm)\n1,47,8,1e-7,15\n"))[0];
  EXPECT_EQ(other.sigma_m, Eigen::Vector3d(0.015, 0.015, 0));
}

TEST_F(GnssFileTest, RefusesHeightsThatNothingFliesAt) {
  const std::string point =
      R"(<trkpt lat="47" lon="8"><ele>1e308</ele><time>2024-05-01T10:00:00Z</time></trkpt>)";
  EXPECT_THAT(ErrorOf("a.gpx", "<gpx><trk><trkseg>\n" + point + "</trkseg></trk></gpx>"),
              AllOf(HasSubstr("a.gpx:2"), HasSubstr("altitude is 1e+308 m: expected -12000 to")));
  EXPECT_THAT(ErrorOf("a.csv", "time,lat,lon,alt\n1,47,8,-20000\n"),
              AllOf(HasSubstr("a.csv:2"), HasSubstr("altitude is -20000 m")));
}

TEST_F(GnssFileTest, AltitudesHaveTheUnitOfTheirName) {
  for (const auto& [name, metres] :
       std::vector<std::pair<std::string, double>>{{"altitude(km)", 1500},
                                                   {"altitude [m]", 1.5},
                                                   {"height_feet", 1.5 * 0.3048},
                                                   {"ele (cm)", 0.015},
                                                   {"alt_yards", 1.5 * 0.9144},
                                                   {"altitude", 1.5}}) {
    const auto fixes = ReadGnssFile(Write("a.csv", "time,lat,lon," + name + "\n1,47,8,1.5\n"));
    EXPECT_DOUBLE_EQ(fixes[0].altitude_m.value_or(0), metres) << name;
  }
}

TEST_F(GnssFileTest, ReadsSemicolonsAndQuotes) {
  for (const std::string text :
       {"time;latitude;longitude;altitude\n1;47.5;8.25;440\n",
        "\"time\",\"latitude\",\"longitude\",\"altitude\"\n\"1\",\"47.5\",\"8.25\",\"440\"\n",
        "1;47.5;8.25;440\n"}) {
    const auto file = Write("a.csv", text);
    EXPECT_TRUE(IsGnssFile(file)) << text;
    const std::vector<GnssFix> fixes = ReadGnssFile(file);
    ASSERT_EQ(fixes.size(), 1u) << text;
    EXPECT_EQ(fixes[0].latitude_deg, 47.5);
    EXPECT_EQ(fixes[0].altitude_m, 440);
  }
}

TEST_F(GnssFileTest, SmallNanosecondsAreNotTakenForSeconds) {
  const auto file = Write("data.csv", "#timestamp [ns],latitude,longitude\n0,1,2\n200000000,1,2\n");
  EXPECT_EQ(ReadGnssFile(file)[1].time.nanoseconds, 200000000);
}

TEST_F(GnssFileTest, ReadsUnitsInWords) {
  const auto file =
      Write("log.csv",
            "time(millisecond),datetime(utc),latitude,longitude,height_above_takeoff(feet)\n"
            "100,2024-05-01 10:00:00,47,8,100\n200,2024-05-01 10:00:00,47,8,\n");
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 100000000);
  EXPECT_DOUBLE_EQ(*fixes[0].altitude_m, 30.48);
  for (const char* name :
       {"altitude [m AMSL]", "alt_m", "Elevation (metres)", "alt", "height_wgs84"}) {
    const auto other =
        Write("other.csv", fmt::format("Time (Seconds),lat,lon,{}\n2,47,8,100\n", name));
    EXPECT_EQ(ReadGnssFile(other)[0].altitude_m, 100) << name;
    EXPECT_EQ(ReadGnssFile(other)[0].time.nanoseconds, 2000000000) << name;
  }
}

TEST_F(GnssFileTest, ZerosAreNoFix) {
  const auto csv = Write("log.csv", "time,lat,lon\n0,0,0\n1,0.0,0.0\n2,47,8\n3,0,8\n");
  EXPECT_EQ(ReadGnssFile(csv).size(), 2u);
  EXPECT_EQ(ReadGnssFile(csv)[0].latitude_deg, 47);
  EXPECT_THAT(ErrorOf("none.csv", "time,lat,lon\n0,0,0\n"), HasSubstr("no position fix"));
}

TEST_F(GnssFileTest, FindsColumnsByNameInAnyOrderAndUnit) {
  const auto file = Write("log.csv", "Lon, LAT , height_m, time_ms, quality\n8,47,,1500.5,4\n");
  EXPECT_TRUE(IsGnssFile(file));
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 1500500000);
  EXPECT_EQ(fixes[0].latitude_deg, 47);
  EXPECT_EQ(fixes[0].longitude_deg, 8);
  EXPECT_FALSE(fixes[0].altitude_m.has_value());
}

TEST_F(GnssFileTest, WithoutHeadTheOrderIsTimeLatitudeLongitudeAltitude) {
  const auto file = Write("log.csv", "12.25,47,8,500\n2.5e1,-47.5,-8,501\n");
  EXPECT_TRUE(IsGnssFile(file));
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 12250000000);
  EXPECT_EQ(fixes[1].latitude_deg, -47.5);
  EXPECT_EQ(fixes[1].altitude_m, 501);
}

TEST_F(GnssFileTest, MomentsWithoutFixAndRepeatedTimesAreLeftOut) {
  const auto file = Write("log.csv", "time,lat,lon\n1,47,8\n2,,\n3,nan,nan\n4,47,8\n4,48,8\n");
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[1].latitude_deg, 47);
}

TEST_F(GnssFileTest, ReadsGpxTracks) {
  const auto file = Write(
      "flight.gpx",
      "<?xml version=\"1.0\"?>\n<gpx version=\"1.1\" "
      "xmlns=\"http://www.topografix.com/GPX/1/1\">\n<wpt lat=\"0\" lon=\"0\"/>\n<trk><trkseg>\n"
      "<trkpt lat=\"47.5\" lon=\"8.5\"><ele>430.5</ele><time>2024-05-01T10:00:00Z</time></trkpt>\n"
      "<trkpt lat=\"47.6\" lon=\"8.6\"><time>2024-05-01T12:00:00.25+02:00</time></trkpt>\n"
      "</trkseg></trk></gpx>\n");
  EXPECT_TRUE(IsGnssFile(file));
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 2u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 1714557600000000000);
  EXPECT_EQ(fixes[1].time.nanoseconds, 1714557600250000000);
  EXPECT_EQ(fixes[0].altitude_m, 430.5);
  EXPECT_EQ(fixes[1].longitude_deg, 8.6);
}

TEST_F(GnssFileTest, BlanksAroundHeadsAndValuesAreNothing) {
  EXPECT_EQ(ReadGnssFile(Write("log.csv", " time,lat,lon \t\n1,47,8\n")).size(), 1u);
  const auto file = Write("flight.gpx",
                          "<gpx><trk><trkseg>\n<trkpt lat=\"47.5\" lon=\"8.5\"><ele> 430.5 </ele>\n"
                          "<time>\n  2024-05-01T10:00:00Z\n</time></trkpt></trkseg></trk></gpx>\n");
  const std::vector<GnssFix> fixes = ReadGnssFile(file);
  ASSERT_EQ(fixes.size(), 1u);
  EXPECT_EQ(fixes[0].time.nanoseconds, 1714557600000000000);
  EXPECT_EQ(fixes[0].altitude_m, 430.5);
}

TEST_F(GnssFileTest, TrajectoriesAreNoFixes) {
  EXPECT_FALSE(IsGnssFile(Write("tum.txt", "# seconds tx ty tz qx qy qz qw\n1 0 0 0 0 0 0 1\n")));
  EXPECT_FALSE(IsGnssFile(Write("euroc.csv", "#ns,px,py,pz,qw,qx,qy,qz\n1,0,0,0,1,0,0,0\n")));
  EXPECT_FALSE(IsGnssFile(Write("kitti.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n")));
}

TEST_F(GnssFileTest, WrongFilesAreErrorsThatNameTheLine) {
  EXPECT_THAT(ErrorOf("a.csv", "time,lat,lon\n1,47,8\n2,north,8\n"),
              AllOf(HasSubstr("a.csv:3"), HasSubstr("'north'")));
  EXPECT_THAT(ErrorOf("a.csv", "1,97,8\n"), AllOf(HasSubstr("a.csv:1"), HasSubstr("latitude")));
  EXPECT_THAT(ErrorOf("a.csv", "2,47,8\n1,47,8\n"), AllOf(HasSubstr("a.csv:2"), HasSubstr("grow")));
  EXPECT_THAT(ErrorOf("a.csv", "time,lat,lon\n1,47\n"), HasSubstr("expected at least 3"));
  EXPECT_THAT(ErrorOf("a.csv", "time,lat,lon\n"), HasSubstr("no position fix"));
  EXPECT_THAT(ErrorOf("a.gpx", "<gpx>\n<trk"), AllOf(HasSubstr("a.gpx:"), HasSubstr("XML")));
  EXPECT_THAT(ErrorOf("a.gpx", "<gpx><trk>\n<trkpt lat=\"1\" lon=\"2\"/></trk></gpx>"),
              AllOf(HasSubstr("a.gpx:2"), HasSubstr("time")));
  EXPECT_THAT(ErrorOf("a.gpx", "<gpx><trk>\n\n<trkpt lat=\"x\" lon=\"2\"/></trk></gpx>"),
              AllOf(HasSubstr("a.gpx:3"), HasSubstr("'x'")));
}

TEST(IsoTime, IsExactAndRefusesWhatIsNone) {
  EXPECT_EQ(ParseIsoTime("1970-01-01T00:00:00.123456789Z", "x").nanoseconds, 123456789);
  EXPECT_EQ(ParseIsoTime("2000-03-01 00:00:00", "x").nanoseconds, 951868800000000000);
  EXPECT_EQ(ParseIsoTime("2000-02-29T23:30:00-00:30", "x").nanoseconds, 951868800000000000);
  for (const char* wrong :
       {"2023-02-29T00:00:00Z", "2023-13-01T00:00:00Z", "2023-01-01", "2023-01-01T25:00:00Z",
        "2023-01-01T00:00:99Z", "yesterday", "2023-01-01T00x00:00Z", "2023-01-01T00:00:00+99:00"}) {
    EXPECT_THROW(ParseIsoTime(wrong, "x"), Error) << wrong;
  }
}

}  // namespace
}  // namespace deepuav
