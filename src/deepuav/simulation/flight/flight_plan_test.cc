#include "deepuav/simulation/flight/flight_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using ::testing::HasSubstr;

const World& Village() {
  static const World world = [] {
    SceneOptions scene;
    scene.extent_m = 500;
    scene.relief_m = 12;
    scene.town_radius_m = 90;
    scene.cars_per_km = scene.people_per_km = 0;
    return World(scene);
  }();
  return world;
}

CourseOptions Course(const std::string& kind) {
  CourseOptions course;
  course.kind = kind;
  course.height_m = 20;
  course.length_m = 120;
  course.top_height_m = 100;
  course.waypoints = "0 0 15; 40 0 15 2 90; 40 40 25";
  return course;
}

std::unique_ptr<FlightPath> Fly(const CourseOptions& course, int seed = 1) {
  Random random(static_cast<uint64_t>(seed));
  return PlanFlight(course, AttitudeOptions{}, WindOptions{}, Village(), &random);
}

Eigen::Vector3d Place(const FlightPath& path, double time_s) {
  return path.At(time_s).world_from_body.translation();
}

std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

constexpr const char* kKinds[] = {"orbit",  "corridor", "circuit",  "figure_eight",
                                  "survey", "climb",    "waypoints"};

TEST(FlightPlan, EveryKindStaysAboveAllThatStandsThere) {
  const double gusts_m = 0.5;
  for (const char* kind : kKinds) {
    CourseOptions course = Course(kind);
    course.height_m = 3;  // through the houses, if nothing raised it
    course.waypoints = "-60 -20 3; 40 0 3 2 90; 40 40 3";
    const std::unique_ptr<FlightPath> path = Fly(course);
    for (double t = 0; t < path->duration_s(); t += 0.2) {
      const Eigen::Vector3d p = Place(*path, t);
      EXPECT_GT(p.z(), Village().ClearanceHeight(p.x(), p.y()) + course.clearance_m - gusts_m)
          << kind << " at " << t << " s";
    }
  }
}

TEST(FlightPlan, EveryKindKeepsSpeedAndAccelerationAndDoesNotJump) {
  for (const char* kind : kKinds) {
    const CourseOptions course = Course(kind);
    const std::unique_ptr<FlightPath> path = Fly(course);
    EXPECT_GT(path->duration_s(), 5) << kind;
    double speed = 0, acceleration = 0, yaw_rate = 0;
    for (double t = 0; t < path->duration_s(); t += 0.05) {
      const BodyState state = path->At(t);
      speed = std::max(speed, state.velocity_world.norm());
      acceleration = std::max(acceleration, state.acceleration_world.norm());
      yaw_rate = std::max(yaw_rate, std::abs(state.angular_velocity_body.z()));
      EXPECT_LT((Place(*path, t + 0.05) - Place(*path, t)).norm(), 0.05 * 8) << kind;
    }
    // Wind adds to what the course keeps.
    EXPECT_LT(speed, course.speed_m_s + 1.5) << kind;
    EXPECT_LT(acceleration, course.acceleration_m_s2 + 4) << kind;
    EXPECT_LT(yaw_rate, course.yaw_rate_deg_s * M_PI / 180 + 0.6) << kind;
  }
}

TEST(FlightPlan, OrbitLooksAtItsMiddle) {
  CourseOptions course = Course("orbit");
  course.radius_m = 40;
  course.height_m = 60;
  const std::unique_ptr<FlightPath> path = Fly(course);
  for (double t = 0; t < path->duration_s(); t += 0.5) {
    const SE3 pose = path->At(t).world_from_body;
    const Eigen::Vector2d out = pose.translation().head<2>();
    EXPECT_NEAR(out.norm(), 40, 1.5);
    EXPECT_GT(-(pose.rotation() * Eigen::Vector3d::UnitX()).head<2>().dot(out.normalized()), 0.99);
  }
}

TEST(FlightPlan, ClimbReachesTheTopAndComesBack) {
  CourseOptions course = Course("climb");
  course.radius_m = 10;
  course.speed_m_s = 8;
  const std::unique_ptr<FlightPath> path = Fly(course);
  double top = 0;
  for (double t = 0; t < path->duration_s(); t += 0.1) top = std::max(top, Place(*path, t).z());
  const double ground = Village().GroundHeight(0, 0);
  EXPECT_NEAR(top - ground, 100, 10);  // the peak is rounded
  EXPECT_NEAR(Place(*path, path->duration_s()).z(), Place(*path, 0).z(), 1.5);
}

TEST(FlightPlan, SurveyComesByWithOppositeHeadings) {
  CourseOptions course = Course("survey");
  course.height_m = 50;
  const std::unique_ptr<FlightPath> path = Fly(course);
  double ahead_s = 0, back_s = 0, across_s = 0;
  for (double t = 0; t < path->duration_s(); t += 0.1) {
    const Eigen::Vector3d x = path->At(t).world_from_body.rotation() * Eigen::Vector3d::UnitX();
    ahead_s += 0.1 * (x.x() > 0.98);
    back_s += 0.1 * (x.x() < -0.98);
    across_s += 0.1 * (std::abs(x.y()) > 0.98);
  }
  EXPECT_GT(ahead_s, 15);
  EXPECT_GT(back_s, 10);
  EXPECT_GT(across_s, 20);
}

TEST(FlightPlan, CorridorFollowsItsRiver) {
  CourseOptions course = Course("corridor");
  course.along = "river";
  course.along_start_m = 60;
  course.height_m = 40;
  const std::unique_ptr<FlightPath> path = Fly(course);
  for (double t = 0; t < path->duration_s(); t += 1) {
    const Eigen::Vector2d place = Place(*path, t).head<2>();
    double nearest = 1e9;
    for (const Eigen::Vector3d& point : Village().rivers().front().points)
      nearest = std::min(nearest, (point.head<2>() - place).norm());
    EXPECT_LT(nearest, 12);
  }
}

TEST(FlightPlan, SidewaysComesFirst) {
  CourseOptions course = Course("circuit");
  course.sideways_m = 10;
  course.height_m = 40;
  const std::unique_ptr<FlightPath> path = Fly(course);
  const SE3 start = path->At(0).world_from_body;
  const Eigen::Vector3d moved = start.Inverse() * Place(*path, 2.5);
  EXPECT_LT(moved.y(), -2);  // to the right
  EXPECT_LT(std::abs(moved.x()), 0.3 * std::abs(moved.y()));
}

TEST(FlightPlan, WaypointsArePassedWithPauseAndTurn) {
  CourseOptions course = Course("waypoints");
  course.waypoints = "0 0 50; 40 0 50 2 90; 40 40 50";
  const std::vector<Leg> legs = PlanLegs(course, Village());
  ASSERT_EQ(legs.size(), 2);
  EXPECT_EQ(legs[0].pause_s, 2);
  EXPECT_NEAR(legs[0].turn_rad, M_PI / 2, 1e-12);
  EXPECT_LT((legs[0].points.back() - legs[1].points.front()).head<3>().norm(), 1e-9);
  EXPECT_NEAR(legs[1].points.back().y(), 40, 1e-9);
}

TEST(FlightPlan, FollowsFromItsSeed) {
  const CourseOptions course = Course("orbit");
  EXPECT_EQ(Place(*Fly(course, 1), 7), Place(*Fly(course, 1), 7));
  EXPECT_NE(Place(*Fly(course, 1), 7), Place(*Fly(course, 2), 7));
}

TEST(FlightPlan, SaysWhatIsWrong) {
  CourseOptions course = Course("orbit");
  course.radius_m = 400;
  EXPECT_THAT(ErrorOf([&] { Fly(course); }), HasSubstr("comes to x"));
  course = Course("corridor");
  course.along_index = 99;
  EXPECT_THAT(ErrorOf([&] { Fly(course); }), HasSubstr("course.along_index is 99"));
  course = Course("corridor");
  course.along_start_m = 1e5;
  EXPECT_THAT(ErrorOf([&] { Fly(course); }), HasSubstr("course.along_start_m"));
  for (const char* waypoints : {"0 0", "0 0 20; 10 x 20", "0 0 20", "1 2 3 4 5 6; 0 0 9", ";"}) {
    course = Course("waypoints");
    course.waypoints = waypoints;
    EXPECT_THAT(ErrorOf([&] { Fly(course); }), HasSubstr("course.waypoints")) << waypoints;
  }
  course = Course("loop");
  EXPECT_THAT(ErrorOf([&] { Fly(course); }), HasSubstr("course.kind is 'loop'"));
}

TEST(FlightPlan, KeepsBelowTheRoofOfAHall) {
  const World hall(LoadScene("hall"));
  CourseOptions course = Course("figure_eight");
  course.length_m = course.width_m = 8;
  course.height_m = 100;
  Random random(1);
  EXPECT_THAT(ErrorOf([&] { PlanFlight(course, AttitudeOptions{}, WindOptions{}, hall, &random); }),
              HasSubstr("below the roof"));
}

}  // namespace
}  // namespace deepuav
