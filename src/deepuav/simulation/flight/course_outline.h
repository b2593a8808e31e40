#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "deepuav/simulation/flight/course_options.h"
#include "deepuav/simulation/world/world.h"

namespace deepuav {

/// A polyline in the world, from one stop to the next.
struct OutlineLeg {
  std::vector<Eigen::Vector3d> points;
  double pause_s = 0;
  double turn_rad = 0;
};

/// The corners of a course, before they are rounded and raised above what stands there. Throws
/// Error as PlanLegs does.
std::vector<OutlineLeg> OutlineCourse(const CourseOptions& course, const World& world);

}  // namespace deepuav
