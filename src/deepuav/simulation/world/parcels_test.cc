#include "deepuav/simulation/world/parcels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "deepuav/base/random.h"
#include "deepuav/simulation/testing/small_land.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;

double AreaOf(const std::vector<Vector2d>& corners) {
  double area = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    area += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return area;
}

/// How far inside its sides a point lies, m; negative outside.
double DepthInside(const std::vector<Vector2d>& corners, const Vector2d& point) {
  double depth = 1e9;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Vector2d side = corners[(i + 1) % corners.size()] - corners[i],
                   offset = point - corners[i];
    depth = std::min(depth, (side.x() * offset.y() - side.y() * offset.x()) / side.norm());
  }
  return depth;
}

ParcelMap::Place PlaceOf(const ParcelMap& map, const Vector2d& point) {
  return map.Find(static_cast<float>(point.x()), static_cast<float>(point.y()));
}

TEST(ParcelsOfALand, LieWhereFindSaysUpToTheBendOfTheirBorders) {
  const ParcelMap map(SmallVillage());
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const Vector2d point(random.Uniform(-250, 250), random.Uniform(-250, 250));
    const ParcelMap::Place place = PlaceOf(map, point);
    ASSERT_GE(place.border_m, 0);
    const double depth = DepthInside(place.parcel->corners, point);
    // Sides of 100 m bend by a metre or two off the straight line through their ends.
    EXPECT_GT(depth, -8);
    if (place.border_m > 8) {
      EXPECT_GT(depth, 0);
      EXPECT_NEAR(depth, place.border_m, 8 + 0.15 * depth);
    }
  }
}

TEST(ParcelsOfALand, ShareItsAreaWithoutGapsOrOverlaps) {
  const ParcelMap map(SmallVillage());
  std::map<const Parcel*, double> found_m2;
  constexpr double kStepM = 1.5;
  for (double y = -249; y < 250; y += kStepM) {
    for (double x = -249; x < 250; x += kStepM)
      found_m2[PlaceOf(map, {x, y}).parcel] += kStepM * kStepM;
  }
  int compared = 0;
  for (const auto& [parcel, area_m2] : found_m2) {
    double reach = 0;
    for (const Vector2d& corner : parcel->corners)
      reach = std::max(reach, corner.cwiseAbs().maxCoeff());
    EXPECT_GT(AreaOf(parcel->corners), 0);
    if (reach > 240) continue;
    ++compared;
    EXPECT_NEAR(area_m2 / AreaOf(parcel->corners), 1, 0.15);
  }
  EXPECT_GT(compared, 20);
}

TEST(ParcelsOfALand, HaveRowsAlongTheirLength) {
  const ParcelMap map(SmallVillage());
  for (const Parcel& parcel : map.parcels()) {
    EXPECT_NEAR(parcel.along.norm(), 1, 1e-6);
    EXPECT_GE(parcel.length_m, parcel.breadth_m);
    EXPECT_GE(parcel.tone, 0.75f);
    EXPECT_LE(parcel.tone, 1.25f);
    double low = 1e9, high = -1e9;
    for (const Vector2d& corner : parcel.corners) {
      low = std::min(low, corner.dot(parcel.along));
      high = std::max(high, corner.dot(parcel.along));
    }
    EXPECT_NEAR((high - low) / parcel.length_m, 1, 0.2);
  }
}

TEST(ParcelsOfATown, AreBuiltOnAsOftenAsAsked) {
  SceneOptions options = SmallVillage();
  options.town_radius_m = 220;
  const auto share = [&](double building_fraction) {
    options.building_fraction = building_fraction;
    int town = 0, built = 0;
    const ParcelMap map(options);
    for (const Parcel& parcel : map.parcels()) {
      if (!parcel.in_town || parcel.kind == ParcelKind::kSquare) continue;
      ++town;
      built += parcel.kind == ParcelKind::kGarden;
      EXPECT_LT(parcel.centre.norm(), options.town_radius_m + 30);
    }
    EXPECT_GT(town, 60);
    return static_cast<double>(built) / town;
  };
  EXPECT_EQ(share(0), 0);
  EXPECT_EQ(share(1), 1);
  EXPECT_NEAR(share(0.5), 0.5, 0.15);
}

TEST(ParcelsOfALand, FollowFromTheSeed) {
  SceneOptions options = SmallVillage();
  const ParcelMap map(options), again(options);
  options.seed = 2;
  const ParcelMap other(options);
  ASSERT_EQ(map.parcels().size(), again.parcels().size());
  for (size_t i = 0; i < map.parcels().size(); ++i) {
    EXPECT_EQ(map.parcels()[i].centre, again.parcels()[i].centre);
    EXPECT_EQ(map.parcels()[i].seed, again.parcels()[i].seed);
  }
  EXPECT_NE(map.parcels()[0].centre, other.parcels()[0].centre);
}

}  // namespace
}  // namespace deepuav
