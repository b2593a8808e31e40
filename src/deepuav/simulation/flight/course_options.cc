#include "deepuav/simulation/flight/course_options.h"

#include <cmath>

#include "deepuav/base/option_check.h"

namespace deepuav {

void CourseOptions::Check() const { CheckOptions("course", *this); }

void CourseOptions::CheckRelations() const {
  constexpr double kWidestTurnM = 500;  // the course is smoothed over so much
  CheckOption(speed_m_s * speed_m_s <= kWidestTurnM * acceleration_m_s2, "speed_m_s", speed_m_s,
              fmt::format("at most {:.1f}, which turns within {} m at that acceleration",
                          std::sqrt(kWidestTurnM * acceleration_m_s2), kWidestTurnM));
  if (kind == "climb")
    CheckOption(top_height_m > height_m, "top_height_m", top_height_m, "more than course.height_m");
  if (kind == "waypoints" && waypoints.empty())
    throw OptionError("waypoints", "empty", "'x y height; x y height; ...'");
}

}  // namespace deepuav
