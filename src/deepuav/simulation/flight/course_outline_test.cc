#include "deepuav/simulation/flight/course_outline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;

CourseOptions Course(const std::string& kind) {
  CourseOptions course;
  course.kind = kind;
  course.center_x_m = 12;
  course.center_y_m = -8;
  course.heading_deg = 30;
  return course;
}

std::vector<Vector3d> Points(const CourseOptions& course) {
  const auto legs = OutlineCourse(course, SmallWorld());
  EXPECT_EQ(legs.size(), 1u);
  return legs.front().points;
}

double Length(const std::vector<Vector3d>& points) {
  double length = 0;
  for (size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

/// In axes of the course: from its middle, x along its heading.
Vector2d InCourse(const CourseOptions& course, const Vector3d& point) {
  const double heading = course.heading_deg * std::numbers::pi / 180;
  return Eigen::Rotation2Dd(-heading) *
         (point.head<2>() - Vector2d(course.center_x_m, course.center_y_m));
}

void ExpectOrbit() {
  CourseOptions course = Course("orbit");
  for (const double laps : {0.25, 1.0, 2.5}) {
    course.laps = laps;
    const auto points = Points(course);
    for (const Vector3d& point : points) {
      EXPECT_NEAR(InCourse(course, point).norm(), course.radius_m, 1e-9);
      EXPECT_NEAR(point.z(), SmallWorld().GroundHeight(12, -8) + course.height_m, 1e-9);
    }
    const double circle = 2 * std::numbers::pi * course.radius_m;
    EXPECT_NEAR(Length(points) / (laps * circle), 1, 1e-3);
    EXPECT_LT((InCourse(course, points.front()) - Vector2d(course.radius_m, 0)).norm(), 1e-9);
  }
}

void ExpectCircuit() {
  CourseOptions course = Course("circuit");
  for (const double laps : {0.1, 0.5, 1.0, 2.75}) {
    course.laps = laps;
    const auto points = Points(course);
    EXPECT_NEAR(Length(points), laps * 2 * (course.length_m + course.width_m), 1e-6);
    for (const Vector3d& point : points) {
      const Vector2d at = InCourse(course, point).cwiseAbs();
      EXPECT_NEAR(std::max(at.x() - course.length_m / 2, at.y() - course.width_m / 2), 0, 1e-9);
    }
  }
}

void ExpectFigureEight() {
  const CourseOptions course = Course("figure_eight");
  const auto points = Points(course);
  Vector2d reach = Vector2d::Zero();
  int crossings = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const Vector2d at = InCourse(course, points[i]);
    reach = reach.cwiseMax(at.cwiseAbs());
    crossings += at.norm() < 1e-6;
  }
  EXPECT_NEAR(reach.x(), course.length_m / 2, 0.1);
  EXPECT_NEAR(reach.y(), course.width_m / 2, 0.1);
  EXPECT_EQ(crossings, 3);  // Where it begins, in the middle, where it ends.
}

void ExpectClimb() {
  CourseOptions course = Course("climb");
  course.laps = 3;
  const auto points = Points(course);
  const double ground = SmallWorld().GroundHeight(12, -8);
  double top = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    top = std::max(top, points[i].z() - ground);
    EXPECT_NEAR(points[i].z(), points[points.size() - 1 - i].z(), 1e-9);
    EXPECT_NEAR(InCourse(course, points[i]).norm(), course.radius_m, 1e-9);
  }
  EXPECT_NEAR(top, course.top_height_m, 1e-9);
  EXPECT_NEAR(points.front().z() - ground, course.height_m, 1e-9);
}

void ExpectSurvey() {
  CourseOptions course = Course("survey");
  for (const bool cross : {false, true}) {
    course.cross_lines = cross;
    const auto points = Points(course);
    const int along = 1 + 60 / 25, across = 1 + 150 / 25;
    ASSERT_EQ(points.size(), 2u * static_cast<size_t>(along + (cross ? across : 0)));
    for (size_t i = 0; i < points.size(); i += 2) {
      const bool is_cross = i >= 2u * along;
      const Vector2d from = InCourse(course, points[i]), to = InCourse(course, points[i + 1]);
      EXPECT_NEAR((to - from).norm(), is_cross ? 60 : 150, 1e-9);
      EXPECT_NEAR(is_cross ? to.x() - from.x() : to.y() - from.y(), 0, 1e-9);
      EXPECT_LT(from.cwiseAbs().x(), 75 + 1e-9);
      EXPECT_LT(from.cwiseAbs().y(), 30 + 1e-9);
      if (i == 0 || i == 2u * along) continue;
      const Vector2d step = from - InCourse(course, points[i - 1]);
      EXPECT_NEAR(step.norm(), course.line_spacing_m, 1e-9);
    }
  }
  course.line_spacing_m = 500;
  course.cross_lines = false;
  EXPECT_EQ(Points(course).size(), 2u);
}

void ExpectCorridor() {
  CourseOptions course = Course("corridor");
  course.length_m = 60;
  course.along_start_m = 35;
  const Polyline& road = SmallWorld().roads().front();
  const auto points = Points(course);
  std::vector<Vector3d> flat = points;
  double whole = 0, nearest_to_start = 1e9;
  for (size_t i = 1; i < road.points.size(); ++i) {
    const double step = (road.points[i] - road.points[i - 1]).norm();
    if (whole <= 35 && whole + step > 35) {
      const Vector3d expected =
          road.points[i - 1] + (35 - whole) / step * (road.points[i] - road.points[i - 1]);
      nearest_to_start = (expected - points.front()).head<2>().norm();
    }
    whole += step;
  }
  EXPECT_LT(nearest_to_start, 1e-9);
  for (size_t i = 0; i < points.size(); ++i) {
    const double ground = SmallWorld().GroundHeight(points[i].x(), points[i].y());
    EXPECT_NEAR(points[i].z(), ground + course.height_m, 1e-9);
    flat[i].z() = ground;
  }
  EXPECT_NEAR(Length(flat), 60, 0.5);
  // To its end where it is shorter.
  course.length_m = 5000;
  EXPECT_LT((Points(course).back() - road.points.back()).head<2>().norm(), 1e-9);
}

// One test, as each makes a world of its own.
TEST(OutlineOfEveryKind, IsOfItsShapeAndAsLongAsAsked) {
  ExpectOrbit();
  ExpectCircuit();
  ExpectFigureEight();
  ExpectClimb();
  ExpectSurvey();
  ExpectCorridor();
}

TEST(OutlineOfWaypoints, IsALegFromPauseToPause) {
  CourseOptions course = Course("waypoints");
  course.waypoints = " 0 0 20;10 0 20;; 10 10 25 2 -90 ; 0 10 25;0 0 20 1;";
  const auto legs = OutlineCourse(course, SmallWorld());
  ASSERT_EQ(legs.size(), 2u);
  ASSERT_EQ(legs[0].points.size(), 3u);
  EXPECT_EQ(legs[0].pause_s, 2);
  EXPECT_NEAR(legs[0].turn_rad, -std::numbers::pi / 2, 1e-12);
  ASSERT_EQ(legs[1].points.size(), 3u);
  EXPECT_EQ(legs[1].points.front(), legs[0].points.back());
  EXPECT_EQ(legs[1].pause_s, 1);
  EXPECT_EQ(legs[1].turn_rad, 0);
  EXPECT_NEAR(legs[0].points[2].x(), 22, 1e-12);
  EXPECT_NEAR(legs[0].points[2].z(), SmallWorld().GroundHeight(22, 2) + 25, 1e-12);
}

TEST(OutlineCourseTest, RefusesWhatCannotBeFollowed) {
  const auto refused = [](const CourseOptions& course, const char* part) {
    EXPECT_THAT([&] { OutlineCourse(course, SmallWorld()); },
                Throws<Error>(Property(&Error::what, HasSubstr(part))));
  };
  CourseOptions course = Course("waypoints");
  for (const auto& [waypoints, part] : std::initializer_list<std::pair<const char*, const char*>>{
           {"", "less than two"},
           {"1 2 3", "less than two"},
           {" ; ;", "less than two"},
           {"1 2 3 4 5", "less than two"},
           {"1 2; 3 4 5", "2 numbers"},
           {"1 2 3 4 5 6; 3 4 5", "6 numbers"},
           {"1 2 x; 3 4 5", "'x'"},
           {"1 2 3m; 3 4 5", "'3m'"},
           {"1 2 nan; 3 4 5", "'nan'"},
           {"1 2 inf; 3 4 5", "'inf'"},
           {"1,2,3; 3 4 5", "'1,2,3'"}}) {
    SCOPED_TRACE(waypoints);
    course.waypoints = waypoints;
    refused(course, part);
  }
  course = Course("corridor");
  course.along_index = 900;
  refused(course, "course.along_index is 900");
  course.along_index = 0;
  course.along_start_m = 9000;
  refused(course, "course.along_start_m");
  course.along = "river";
  course.along_index = 1;
  refused(course, "1 rivers");
}

}  // namespace
}  // namespace deepuav
