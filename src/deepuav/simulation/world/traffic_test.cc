#include "deepuav/simulation/world/traffic.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "deepuav/simulation/testing/small_land.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;
using Mover = Traffic::Mover;

constexpr int kPerson = 4;  // Of the prototypes.

SceneOptions BusyVillage() {
  SceneOptions options = SmallVillage();
  options.cars_per_km = 60;
  options.people_per_km = 40;
  return options;
}

struct BusyRoads {
  explicit BusyRoads(const SceneOptions& options = BusyVillage())
      : land(options), traffic(options, land.roads, land.terrain) {}
  Land land;
  Traffic traffic;
};

Vector3d PositionAt(const Traffic& traffic, const Mover& mover, double time_s) {
  return traffic.PlacementAt(mover, time_s).col(3).cast<double>();
}

// Half a metre: a lane beside the bends of its road's line is a little longer or shorter.
TEST(TrafficMotion, IsSteadyButForTheJumpBackToTheRoadsStart) {
  const BusyRoads busy;
  constexpr double kStepS = 0.05;
  for (const Mover& mover : busy.traffic.movers()) {
    Vector3d before = PositionAt(busy.traffic, mover, 0);
    for (double t = kStepS; t < 12; t += kStepS) {
      const Vector3d now = PositionAt(busy.traffic, mover, t);
      const double moved = (now - before).norm();
      const bool jumps = busy.traffic.Jumps(mover, t - kStepS, t);
      if (!jumps) {
        ASSERT_LT(moved, std::abs(mover.speed_m_s) * kStepS + 0.5) << t;
      } else {
        ASSERT_GT(moved, 10);
      }
      before = now;
    }
  }
}

TEST(TrafficMotion, LooksWhereItGoesAndStandsOnTheGround) {
  const BusyRoads busy;
  int looked_at = 0;
  for (const Mover& mover : busy.traffic.movers()) {
    for (const double t : {0.0, 3.3, 7.7}) {
      if (busy.traffic.Jumps(mover, t - 0.2, t + 0.2)) continue;
      const Placement here = busy.traffic.PlacementAt(mover, t);
      const Vector3d moved =
          PositionAt(busy.traffic, mover, t + 0.2) - PositionAt(busy.traffic, mover, t - 0.2);
      const Vector3d ahead = here.col(0).cast<double>();
      EXPECT_GT(ahead.dot(moved.normalized()), 0.8);
      EXPECT_NEAR(here.leftCols<3>().determinant(), 1, 1e-4);
      EXPECT_NEAR(here(2, 3), busy.land.terrain.Height(here(0, 3), here(1, 3)), 1e-3);
      ++looked_at;
    }
  }
  EXPECT_GT(looked_at, 50);
}

TEST(TrafficLanes, AreOnTheRightOfTheRoadAndPeopleWalkBesideIt) {
  const BusyRoads busy;
  int cars = 0, people = 0;
  for (const Mover& mover : busy.traffic.movers()) {
    const Road& road = busy.land.roads.roads()[static_cast<size_t>(mover.road)];
    EXPECT_LT(mover.lane_m * mover.speed_m_s, 0);
    if (mover.prototype == kPerson) {
      EXPECT_GT(std::abs(mover.lane_m), road.half_width_m);
      EXPECT_NE(road.road_class, RoadClass::kHighway);
      ++people;
    } else {
      EXPECT_LT(std::abs(mover.lane_m), road.half_width_m);
      ++cars;
    }
  }
  EXPECT_GT(cars, 10);
  EXPECT_GT(people, 10);
}

TEST(TrafficLanes, KeepTheirDistanceAtAnyTimeAlsoOverTheRoadsEnd) {
  const BusyRoads busy;
  const auto& movers = busy.traffic.movers();
  int pairs = 0;
  for (size_t i = 0; i < movers.size(); ++i) {
    for (size_t j = i + 1; j < movers.size(); ++j) {
      if (movers[i].road != movers[j].road || movers[i].lane_m != movers[j].lane_m) continue;
      if (movers[i].prototype == kPerson) continue;
      ++pairs;
      for (double t = 0; t < 120; t += 7) {
        const Vector3d apart =
            PositionAt(busy.traffic, movers[i], t) - PositionAt(busy.traffic, movers[j], t);
        // Slots of 9 m along the line; the inner lane of a bend is shorter.
        ASSERT_GT(apart.norm(), 7.5) << t;
      }
    }
  }
  EXPECT_GT(pairs, 5);
}

TEST(TrafficLaps, BringEveryoneBackToWhereTheyWere) {
  const BusyRoads busy;
  for (const Mover& mover : busy.traffic.movers()) {
    const Road& road = busy.land.roads.roads()[static_cast<size_t>(mover.road)];
    const double lap_s = road.length_m() / std::abs(mover.speed_m_s);
    EXPECT_LT((PositionAt(busy.traffic, mover, 2 + 3 * lap_s) - PositionAt(busy.traffic, mover, 2))
                  .norm(),
              1e-2);
    EXPECT_TRUE(busy.traffic.Jumps(mover, 2, 2 + lap_s));
  }
}

TEST(TrafficStop, NeverRollsBackAndStartsAsItBraked) {
  SceneOptions options = BusyVillage();
  options.traffic_stop_s = 6;
  options.traffic_stands_s = 4;
  const BusyRoads busy(options);
  const Mover* far = nullptr;
  for (const Mover& mover : busy.traffic.movers()) {
    if (mover.prototype != kPerson && !busy.traffic.Jumps(mover, 0, 20)) far = &mover;
  }
  ASSERT_NE(far, nullptr);
  const auto speed = [&](double t) {
    return (PositionAt(busy.traffic, *far, t + 0.05) - PositionAt(busy.traffic, *far, t - 0.05))
               .dot(busy.traffic.PlacementAt(*far, t).col(0).cast<double>()) /
           0.1;
  };
  const double full = std::abs(far->speed_m_s);
  for (double t = 0.5; t < 18; t += 0.25) EXPECT_GT(speed(t), -0.02) << t;
  EXPECT_NEAR(speed(2), full, 0.15 * full);
  EXPECT_NEAR(speed(4.5), full / 2, 0.15 * full);  // Half of three seconds of braking.
  EXPECT_NEAR(speed(8), 0, 0.02);
  EXPECT_NEAR(speed(11.5), full / 2, 0.15 * full);
  EXPECT_NEAR(speed(15), full, 0.15 * full);
}

TEST(TrafficFactor, OfNoneLeavesEveryoneStanding) {
  SceneOptions options = BusyVillage();
  options.traffic_speed_factor = 0;
  const BusyRoads busy(options);
  ASSERT_FALSE(busy.traffic.movers().empty());
  for (const Mover& mover : busy.traffic.movers()) {
    const Placement at = busy.traffic.PlacementAt(mover, 100);
    EXPECT_TRUE(at.allFinite());
    EXPECT_EQ(at, busy.traffic.PlacementAt(mover, 0));
    EXPECT_FALSE(busy.traffic.Jumps(mover, 0, 100));
  }
}

TEST(TrafficCount, IsAsManyAKilometreAsAsked) {
  SceneOptions options = BusyVillage();
  options.extent_m = 1200;
  const BusyRoads busy(options);
  double km = 0;
  for (const Road& road : busy.land.roads.roads()) {
    // Tracks are a tenth as busy.
    km += road.length_m() / 1000 * (road.road_class == RoadClass::kTrack ? 0.1 : 1);
  }
  int cars = 0;
  for (const Mover& mover : busy.traffic.movers()) cars += mover.prototype != kPerson;
  const double expected = options.cars_per_km * km;
  EXPECT_NEAR(cars, expected, 4 * std::sqrt(expected));
  options.cars_per_km = options.people_per_km = 0;
  EXPECT_TRUE(BusyRoads(options).traffic.movers().empty());
}

}  // namespace
}  // namespace deepuav
