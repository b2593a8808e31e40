#include "deepuav/sensors/geodesy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "support/flights.h"

namespace deepuav {
namespace {

constexpr double kEquatorMetresPerDegree = 6378137.0 * M_PI / 180;

TEST(LocalTrajectory, MetresEastAndNorthOfTheFirstFix) {
  const Trajectory trajectory = LocalTrajectory(
      {{AtSeconds(0), 0, 10, 0.0}, {AtSeconds(1), 0, 10.001, 0.0}, {AtSeconds(2), 0.001, 10, 5.0}},
      true);
  EXPECT_LT(trajectory[0].world_from_cam.translation().norm(), 1e-9);
  EXPECT_NEAR(trajectory[1].world_from_cam.translation().x(), 0.001 * kEquatorMetresPerDegree,
              1e-3);
  EXPECT_NEAR(trajectory[1].world_from_cam.translation().y(), 0, 1e-6);
  // A degree of latitude at the equator is 110,574 m on WGS 84.
  EXPECT_NEAR(trajectory[2].world_from_cam.translation().y(), 110.574, 2e-3);
  EXPECT_NEAR(trajectory[2].world_from_cam.translation().z(), 5, 2e-3);
}

TEST(LocalTrajectory, OneMissingAltitudeLeavesAllOut) {
  const Trajectory trajectory =
      LocalTrajectory({{AtSeconds(0), 0, 0, 100.0}, {AtSeconds(1), 0, 0, std::nullopt}}, true);
  EXPECT_NEAR(trajectory[1].world_from_cam.translation().z(), 0, 1e-6);
}

TEST(Geodesy, PointsGoThereAndBack) {
  const GeoPoint origin{47.4, 8.5, 500};
  const Eigen::Vector3d position_m(1200, -340, 56);
  const GeoPoint point = GeoFromLocal(origin, position_m);
  EXPECT_LT((LocalFromGeo(origin, point) - position_m).norm(), 1e-6);
  EXPECT_GT(point.longitude_deg, origin.longitude_deg);
  EXPECT_LT(point.latitude_deg, origin.latitude_deg);
}

TEST(Geodesy, UtmOfKnownPoints) {
  // By definition: a zone's central meridian at the equator.
  const UtmZone north = UtmZoneOf({0, 9, 0});
  EXPECT_EQ(north.Epsg(), 32632);
  EXPECT_LT((UtmFromGeo(north, {0, 9, 12}) - Eigen::Vector3d(500000, 0, 12)).norm(), 1e-6);
  EXPECT_EQ(UtmZoneOf({-33.9, 151.2, 0}).Epsg(), 32756);
  // Beside its zone and across the equator, the grid goes on.
  const Eigen::Vector3d across = UtmFromGeo(north, {-0.001, 9, 0});
  EXPECT_NEAR(across.y(), -0.001 * 110574 * 0.9996, 0.01);
  const GeoPoint back = GeoFromUtm(north, across);
  EXPECT_NEAR(back.latitude_deg, -0.001, 1e-9);
  EXPECT_NEAR(back.longitude_deg, 9, 1e-9);
  EXPECT_THROW(UtmZoneOf({89, 0, 0}), Error);
}

TEST(Geodesy, AFrameMovesIntoAnotherRigidly) {
  const GeoPoint origin{47.4, 8.5, 500}, other{47.41, 8.52, 450};
  const SE3 other_from_origin = LocalFromLocal(other, origin);
  for (const Eigen::Vector3d& position_m :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2000, 100, 30), Eigen::Vector3d(-50, 900, -3)}) {
    const Eigen::Vector3d there = LocalFromGeo(other, GeoFromLocal(origin, position_m));
    EXPECT_LT((other_from_origin * position_m - there).norm(), 1e-5);
  }
}

}  // namespace
}  // namespace deepuav
