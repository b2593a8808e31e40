#include "deepuav/simulation/course_options.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/option_bounds.h"

namespace deepuav {
namespace {

constexpr std::array<std::string_view, 7> kKinds = {
    "orbit", "corridor", "circuit", "figure_eight", "survey", "climb", "waypoints"};
constexpr std::array<std::string_view, 2> kAlong = {"road", "river"};
constexpr std::array<std::string_view, 4> kYaws = {"auto", "course", "center", "fixed"};
constexpr double kFarthestM = 10'000, kMostTurnDeg = 3600;
constexpr double kWidestTurnM = 500;  // the course is smoothed over so much

void CheckWord(std::span<const std::string_view> known, const std::string& name,
               const std::string& found) {
  if (std::find(known.begin(), known.end(), found) != known.end()) return;
  throw Error("option {} is '{}': expected {}", name, found, fmt::join(known, ", "));
}

}  // namespace

void CourseOptions::Check() const {
  CheckWord(kKinds, "course.kind", kind);
  CheckWord(kAlong, "course.along", along);
  CheckWord(kYaws, "course.yaw", yaw);
  CheckRange("course.center_x_m", center_x_m, -kFarthestM, kFarthestM);
  CheckRange("course.center_y_m", center_y_m, -kFarthestM, kFarthestM);
  CheckRange("course.heading_deg", heading_deg, -kMostTurnDeg, kMostTurnDeg);
  CheckRange("course.yaw_offset_deg", yaw_offset_deg, -kMostTurnDeg, kMostTurnDeg);
  CheckPositive("course.height_m", height_m, kFarthestM);
  CheckRange("course.clearance_m", clearance_m, 0, kFarthestM);
  CheckRange("course.speed_m_s", speed_m_s, 0.1, 100);
  CheckRange("course.acceleration_m_s2", acceleration_m_s2, 0.1, 100);
  CheckOption(speed_m_s * speed_m_s <= kWidestTurnM * acceleration_m_s2, "course.speed_m_s",
              speed_m_s,
              fmt::format("at most {:.1f}, which turns within {} m at that acceleration",
                          std::sqrt(kWidestTurnM * acceleration_m_s2), kWidestTurnM));
  CheckRange("course.yaw_rate_deg_s", yaw_rate_deg_s, 0.1, 3600);
  CheckPositive("course.radius_m", radius_m, kFarthestM);
  CheckPositive("course.length_m", length_m, kFarthestM);
  CheckPositive("course.width_m", width_m, kFarthestM);
  CheckRange("course.line_spacing_m", line_spacing_m, 0.1, kFarthestM);
  CheckPositive("course.laps", laps, 1000);
  CheckRange("course.along_index", along_index, 0, 1000);
  CheckRange("course.along_start_m", along_start_m, 0, kFarthestM);
  CheckRange("course.sideways_m", sideways_m, 0, kFarthestM);
  CheckRange("course.kidnap_at_s", kidnap_at_s, 0, kLongestFlightS);
  CheckRange("course.kidnap_to_s", kidnap_to_s, 0, kLongestFlightS);
  CheckPositive("course.top_height_m", top_height_m, kFarthestM);
  if (kind == "climb")
    CheckOption(top_height_m > height_m, "course.top_height_m", top_height_m,
                "more than course.height_m");
  if (kind == "waypoints" && waypoints.empty())
    throw Error("option course.waypoints is empty: expected 'x y height; x y height; ...'");
}

}  // namespace deepuav
