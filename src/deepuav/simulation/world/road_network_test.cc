#include "deepuav/simulation/world/road_network.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/simulation/testing/small_land.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;

constexpr auto kNowhereBlocked = [](const Vector2d&) { return false; };

RoadNetwork::Place Find(const RoadNetwork& roads, const Vector2d& point) {
  return roads.Find(static_cast<float>(point.x()), static_cast<float>(point.y()));
}

TEST(RoadNetworkPlaces, OfPointsBesideARoadAreThoseTheyWereMadeFrom) {
  const RoadNetwork roads(
      {{{{-120, -80}, {-30, -60}, {20, -10}, {25, 60}, {90, 110}}, RoadClass::kHighway}}, 150,
      kNowhereBlocked);
  ASSERT_EQ(roads.roads().size(), 1u);
  const Road& road = roads.roads()[0];
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    // Away from the corners, where two segments are as near.
    const size_t k = 1 + static_cast<size_t>(random.Index(4));
    const Vector2d span = road.points[k] - road.points[k - 1];
    const double share = random.Uniform(0.2, 0.8), across = random.Uniform(-8, 8);
    const Vector2d left(-span.y(), span.x());
    const Vector2d point = road.points[k - 1] + share * span + across * left.normalized();
    const RoadNetwork::Place place = Find(roads, point);
    ASSERT_EQ(place.road, &road);
    EXPECT_NEAR(place.across_m, across, 1e-3);
    EXPECT_NEAR(place.along_m, road.arc_m[k - 1] + share * span.norm(), 1e-2);
    EXPECT_NEAR(place.edge_m, std::abs(across) - road.half_width_m, 1e-3);
    EXPECT_FALSE(place.junction);
  }
}

TEST(RoadNetworkPlaces, TellACrossingInWhateverOrderTheRoadsCome) {
  const RoadSite east{{{-100, 0}, {100, 0}}, RoadClass::kStreet},
      north{{{10, -90}, {10, 90}}, RoadClass::kTrack};
  for (const auto& sites : {std::vector{east, north}, std::vector{north, east}}) {
    const RoadNetwork roads(sites, 150, kNowhereBlocked);
    EXPECT_TRUE(Find(roads, {10, 0}).junction);
    EXPECT_TRUE(Find(roads, {11, -2.5}).junction);
    EXPECT_FALSE(Find(roads, {10, 20}).junction);
    EXPECT_FALSE(Find(roads, {-40, 1}).junction);
    // Beside both the nearer edge counts: 1 m from the track's, 2 m from the street's.
    const RoadNetwork::Place beside = Find(roads, {12.5, 4.9});
    ASSERT_NE(beside.road, nullptr);
    EXPECT_EQ(beside.road->road_class, RoadClass::kTrack);
    EXPECT_NEAR(beside.edge_m, 1, 1e-4);
  }
}

TEST(RoadNetworkPlaces, AreNoneWithoutRoadsAndOutside) {
  const RoadNetwork none({}, 100, kNowhereBlocked);
  for (const Vector2d& point : {Vector2d(0, 0), Vector2d(99, -99), Vector2d(1e6, 0)})
    EXPECT_EQ(Find(none, point).road, nullptr);
  const RoadNetwork one({{{{-90, 0}, {90, 0}}, RoadClass::kStreet}}, 100, kNowhereBlocked);
  for (const Vector2d& point : {Vector2d(-100.5, 0), Vector2d(130, 0), Vector2d(0, -1e7)})
    EXPECT_EQ(Find(one, point).road, nullptr);
}

TEST(RoadNetworkPieces, TooShortToDriveOnAreLeftOutAndTheLongestComesFirst) {
  const RoadNetwork roads({{{{0, 0}, {24, 0}}, RoadClass::kStreet},
                           {{{0, 10}, {40, 10}}, RoadClass::kStreet},
                           {{{0, 20}, {70, 20}}, RoadClass::kTrack},
                           {{{5, 5}}, RoadClass::kTrack},
                           {{}, RoadClass::kTrack}},
                          100, kNowhereBlocked);
  ASSERT_EQ(roads.roads().size(), 2u);
  EXPECT_NEAR(roads.roads()[0].length_m(), 70, 1e-12);
  EXPECT_NEAR(roads.roads()[1].length_m(), 40, 1e-12);
}

/// How far a point lies beyond the edge of the nearest road but `road`, m; negative on it.
double DistanceToOthers(const std::vector<Road>& roads, const Road& road, const Vector2d& point) {
  double nearest = 1e9;
  for (const Road& other : roads) {
    if (&other == &road) continue;
    for (size_t k = 1; k < other.points.size(); ++k) {
      const Vector2d span = other.points[k] - other.points[k - 1];
      const double t =
          std::clamp((point - other.points[k - 1]).dot(span) / span.squaredNorm(), 0.0, 1.0);
      nearest =
          std::min(nearest, (point - other.points[k - 1] - t * span).norm() - other.half_width_m);
    }
  }
  return nearest;
}

// A street begins and ends at the border between fields: where no road runs along that, it is
// blind.
TEST(RoadNetworkOfALand, HangsTogetherButForFewBlindStreets) {
  int ends = 0, blind = 0;
  for (const int seed : {1, 2, 3, 4}) {
    SceneOptions options = SmallVillage();
    options.seed = seed;
    options.lake_radius_m = 0;
    const Land land(options);
    const auto& roads = land.roads.roads();
    ASSERT_GT(roads.size(), 3u);
    for (const Road& road : roads) {
      for (size_t k = 1; k < road.points.size(); ++k)
        EXPECT_LT((road.points[k] - road.points[k - 1]).norm(), 13);
      if (road.road_class == RoadClass::kTrack) continue;
      for (const Vector2d& end : {road.points.front(), road.points.back()}) {
        const bool at_border = end.cwiseAbs().maxCoeff() > options.extent_m / 2 - 7;
        ++ends;
        blind += !at_border && DistanceToOthers(roads, road, end) > 0;
      }
    }
  }
  EXPECT_GT(ends, 40);
  EXPECT_LT(10 * blind, ends) << blind << " of " << ends;
}

}  // namespace
}  // namespace deepuav
