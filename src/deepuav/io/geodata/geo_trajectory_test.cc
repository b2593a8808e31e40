#include "deepuav/io/geodata/geo_trajectory.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "deepuav/base/error.h"
#include "deepuav/io/geodata/gnss_file.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

const GeoPoint kOrigin{47.4, 8.5, 500};

Trajectory Path() {
  Trajectory path;
  for (int i = 0; i < 3; ++i) {
    path.push_back({Timestamp{1700000000000000000 + i * int64_t{100000000}},
                    SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(10.0 * i, -5.0 * i, i))});
  }
  return path;
}

TEST(GeoTrajectory, AGpxIsReadBackAsItsFixes) {
  const TemporaryFolder folder;
  WriteGpx(folder.path() / "path.gpx", kOrigin, Path());
  const std::vector<GnssFix> fixes = ReadGnssFile(folder.path() / "path.gpx");
  ASSERT_EQ(fixes.size(), 3u);
  EXPECT_EQ(fixes[2].time, Path()[2].time);
  const GeoPoint point{fixes[2].latitude_deg, fixes[2].longitude_deg, *fixes[2].altitude_m};
  EXPECT_LT((LocalFromGeo(kOrigin, point) - Eigen::Vector3d(20, -10, 2)).norm(), 1e-3);
}

TEST(GeoTrajectory, GeoJsonHasLongitudeFirst) {
  const TemporaryFolder folder;
  WriteGeoJson(folder.path() / "path.geojson", kOrigin, Path());
  std::ifstream stream(folder.path() / "path.geojson");
  const auto json = nlohmann::json::parse(stream);
  EXPECT_EQ(json["geometry"]["type"], "LineString");
  ASSERT_EQ(json["geometry"]["coordinates"].size(), 3u);
  EXPECT_NEAR(json["geometry"]["coordinates"][0][0].get<double>(), 8.5, 1e-9);
  EXPECT_NEAR(json["geometry"]["coordinates"][0][2].get<double>(), 500, 1e-4);
  EXPECT_EQ(json["properties"]["times"][1], "2023-11-14T22:13:20.100000000Z");
}

TEST(GeoTrajectory, KmlHoldsThePoints) {
  const TemporaryFolder folder;
  WriteKml(folder.path() / "path.kml", kOrigin, Path());
  std::ifstream stream(folder.path() / "path.kml");
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  EXPECT_NE(text.find("8.500000000,47.400000000,500.0000\n"), std::string::npos);
}

TEST(GeoTrajectory, APoseThatIsNotFiniteIsRefused) {
  const TemporaryFolder folder;
  Trajectory path = Path();
  path[1].world_from_cam = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(NAN, 0, 0));
  EXPECT_THROW(WriteGpx(folder.path() / "path.gpx", kOrigin, path), Error);
}

}  // namespace
}  // namespace deepuav
