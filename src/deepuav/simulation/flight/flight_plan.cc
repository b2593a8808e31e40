#include "deepuav/simulation/flight/flight_plan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/simulation/flight/course_outline.h"

namespace deepuav {
namespace {

constexpr double kStepM = 1;
constexpr double kRadiansPerDegree = std::numbers::pi / 180;
// A bend of a quarter turn, smoothed over this many v^2 / a, is flown at almost full speed.
constexpr double kSmoothingPerTurningRadius = 1.5;
constexpr double kBodyRadiusM = 2;        // rotors, gusts
constexpr double kCutCornerShare = 0.15;  // of the smoothing: how far the course leaves a corner
constexpr double kLeastRoofDistanceM = 0.5;
constexpr double kLeastEdgeDistanceM = 1;
constexpr double kLongestCourseM = 50'000;

double SmoothingLength(const CourseOptions& course) {
  const double turning_radius = course.speed_m_s * course.speed_m_s / course.acceleration_m_s2;
  return std::max(kSmoothingPerTurningRadius * turning_radius, 6 * kStepM);
}

std::string YawOf(const CourseOptions& course) {
  if (course.yaw != "auto") return course.yaw;
  if (course.kind == "orbit") return "center";
  if (course.kind == "climb") return "fixed";
  return "course";
}

double HeadingOf(const FlatOutput& motion) { return std::atan2(motion.y(), motion.x()); }

// Yaw at each of the points, which have none yet, without jumps.
void SetYaw(const CourseOptions& course, std::vector<FlatOutput>* points) {
  const std::string yaw = YawOf(course);
  const FlatOutput centre(course.center_x_m, course.center_y_m, 0, 0);
  double last = course.heading_deg * kRadiansPerDegree;
  for (size_t i = 0; i < points->size(); ++i) {
    FlatOutput& point = (*points)[i];
    double heading = course.heading_deg * kRadiansPerDegree;
    if (yaw == "center") heading = HeadingOf(centre - point);
    if (yaw == "course") {
      const size_t to = std::min(i + 1, points->size() - 1), from = to == 0 ? 0 : to - 1;
      heading = HeadingOf((*points)[to] - (*points)[from]);
    }
    heading += course.yaw_offset_deg * kRadiansPerDegree;
    last += std::remainder(heading - last, 2 * std::numbers::pi);
    point.w() = last;
  }
}

// Comes to the first point from its left, looking as there.
void PrependSideways(double length_m, std::vector<FlatOutput>* points) {
  const FlatOutput& first = points->front();
  const FlatOutput right(std::sin(first.w()), -std::cos(first.w()), 0, 0);
  std::vector<FlatOutput> path = Resample({first - length_m * right, first}, kStepM);
  path.pop_back();
  points->insert(points->begin(), path.begin(), path.end());
}

void RaiseAboveObstacles(const CourseOptions& course, const World& world, double window_m,
                         std::vector<FlatOutput>* points) {
  const double radius_m = kBodyRadiusM + kCutCornerShare * window_m;
  std::vector<double> least(points->size());
  for (size_t i = 0; i < least.size(); ++i) {
    const FlatOutput& point = (*points)[i];
    least[i] = world.ClearanceHeight(point.x(), point.y(), radius_m) + course.clearance_m;
  }
  const int reach = static_cast<int>(std::ceil(window_m / 2 / kStepM)) + 1;
  const int count = static_cast<int>(least.size());
  for (int i = 0; i < count; ++i) {
    const auto from = least.begin() + std::max(0, i - reach);
    const auto to = least.begin() + std::min(count, i + reach + 1);
    double& z = (*points)[static_cast<size_t>(i)].z();
    z = std::max(z, *std::max_element(from, to));
  }
}

void CheckInside(const World& world, const std::vector<FlatOutput>& points) {
  const Eigen::Vector2d half = world.HalfExtent();
  const std::optional<double> ceiling = world.CeilingHeight();
  for (const FlatOutput& point : points) {
    if (std::abs(point.x()) > half.x() - kLeastEdgeDistanceM ||
        std::abs(point.y()) > half.y() - kLeastEdgeDistanceM) {
      throw Error(
          "the course comes to x = {:.1f} m, y = {:.1f} m: expected |x| below {:.1f} m and |y| "
          "below "
          "{:.1f} m in this scene",
          point.x(), point.y(), half.x(), half.y());
    }
    if (ceiling && point.z() > *ceiling - kLeastRoofDistanceM) {
      throw Error("the course comes to z = {:.1f} m: expected {} m below the roof at {:.1f} m",
                  point.z(), kLeastRoofDistanceM, *ceiling);
    }
  }
}

void CheckLength(const std::vector<FlatOutput>& corners) {
  double length_m = 0;
  for (size_t i = 1; i < corners.size(); ++i)
    length_m += (corners[i] - corners[i - 1]).head<3>().norm();
  if (!(length_m <= kLongestCourseM)) {
    throw Error("the course is {:.1f} km long: expected at most {:.0f} (course.laps, its size)",
                length_m / 1e3, kLongestCourseM / 1e3);
  }
}

// Points a metre apart with sharp corners, high enough.
std::vector<FlatOutput> PlanPoints(const CourseOptions& course, const World& world,
                                   const std::vector<Eigen::Vector3d>& corners, bool first_leg) {
  std::vector<FlatOutput> points;
  for (const Eigen::Vector3d& corner : corners)
    points.emplace_back(corner.x(), corner.y(), corner.z(), 0);
  CheckLength(points);
  points = Resample(points, kStepM);
  SetYaw(course, &points);
  if (first_leg && course.sideways_m > 0) PrependSideways(course.sideways_m, &points);
  RaiseAboveObstacles(course, world, SmoothingLength(course), &points);
  CheckInside(world, points);
  return points;
}

void RaiseEnd(double z, int count, std::vector<FlatOutput>* points) {
  const auto first = points->size() - std::min(points->size(), static_cast<size_t>(count));
  for (size_t i = first; i < points->size(); ++i) (*points)[i].z() = std::max((*points)[i].z(), z);
}

// What was raised at the end of one leg is raised at the start of the next as well, and far enough
// for the smoothing.
void JoinLegs(double window_m, std::vector<Leg>* legs) {
  const int count = static_cast<int>(std::ceil(window_m / kStepM));
  for (size_t i = 1; i < legs->size(); ++i) {
    std::vector<FlatOutput>& before = (*legs)[i - 1].points;
    std::vector<FlatOutput>& after = (*legs)[i].points;
    const double z = std::max(before.back().z(), after.front().z());
    RaiseEnd(z, count, &before);
    std::reverse(after.begin(), after.end());
    RaiseEnd(z, count, &after);
    std::reverse(after.begin(), after.end());
  }
}

}  // namespace

std::vector<Leg> PlanLegs(const CourseOptions& course, const World& world) {
  course.Check();
  const double window_m = SmoothingLength(course);
  std::vector<Leg> legs;
  for (const OutlineLeg& outline : OutlineCourse(course, world)) {
    legs.push_back({PlanPoints(course, world, outline.points, legs.empty()), outline.pause_s,
                    outline.turn_rad});
  }
  JoinLegs(window_m, &legs);
  for (Leg& leg : legs) {
    // Resampled, as a rise makes points lie further apart.
    leg.points = Smooth(Resample(leg.points, kStepM), kStepM, window_m);
    if (YawOf(course) == "center") SetYaw(course, &leg.points);
  }
  return legs;
}

std::unique_ptr<FlightPath> PlanFlight(const CourseOptions& course, const AttitudeOptions& attitude,
                                       const WindOptions& wind, const World& world,
                                       Random* random) {
  attitude.Check();
  wind.Check();
  const std::vector<Leg> legs = PlanLegs(course, world);
  std::vector<MinimumSnapCurve> curves = FlyLegs(legs, {course.speed_m_s, course.acceleration_m_s2,
                                                        course.yaw_rate_deg_s * kRadiansPerDegree});
  std::optional<Kidnap> kidnap;
  if (course.kidnap_at_s > 0) kidnap = Kidnap{course.kidnap_at_s, course.kidnap_to_s};
  return std::make_unique<QuadrotorPath>(std::move(curves), attitude, WindJitter(wind, random),
                                         kidnap);
}

}  // namespace deepuav
