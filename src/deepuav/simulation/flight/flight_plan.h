#pragma once

#include <memory>

#include "deepuav/base/random.h"
#include "deepuav/simulation/flight/course_options.h"
#include "deepuav/simulation/flight/quadrotor_path.h"
#include "deepuav/simulation/flight/route.h"
#include "deepuav/simulation/world/world.h"

namespace deepuav {

/// The legs of a course over a world: points a metre apart, round corners, above all that stands
/// below by course.clearance_m. Throws Error for a course that leaves the world, comes through a
/// hall's roof, follows a road or river that is not there, or has waypoints that cannot be read.
std::vector<Leg> PlanLegs(const CourseOptions& course, const World& world);

/// The flight of a quadrotor over a world. `random` makes the wind.
std::unique_ptr<FlightPath> PlanFlight(const CourseOptions& course, const AttitudeOptions& attitude,
                                       const WindOptions& wind, const World& world, Random* random);

}  // namespace deepuav
