#include "deepuav/simulation/course_options.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr std::array<std::string_view, 7> kKinds = {
    "orbit", "corridor", "circuit", "figure_eight", "survey", "climb", "waypoints"};
constexpr std::array<std::string_view, 2> kAlong = {"road", "river"};
constexpr std::array<std::string_view, 4> kYaws = {"auto", "course", "center", "fixed"};

void CheckWord(std::span<const std::string_view> known, const std::string& name,
               const std::string& found) {
  if (std::find(known.begin(), known.end(), found) != known.end()) return;
  throw Error("option {} is '{}': expected {}", name, found, fmt::join(known, ", "));
}

void CheckAbove(double low, const std::string& name, double found) {
  CheckOption(found > low, name, found, fmt::format("more than {}", low));
}

void CheckAtLeast(double low, const std::string& name, double found) {
  CheckOption(found >= low, name, found, fmt::format("at least {}", low));
}

}  // namespace

void CourseOptions::Check() const {
  CheckWord(kKinds, "course.kind", kind);
  CheckWord(kAlong, "course.along", along);
  CheckWord(kYaws, "course.yaw", yaw);
  CheckAbove(0, "course.height_m", height_m);
  CheckAtLeast(0, "course.clearance_m", clearance_m);
  CheckAbove(0, "course.speed_m_s", speed_m_s);
  CheckAbove(0, "course.acceleration_m_s2", acceleration_m_s2);
  CheckAbove(0, "course.yaw_rate_deg_s", yaw_rate_deg_s);
  CheckAbove(0, "course.radius_m", radius_m);
  CheckAbove(0, "course.length_m", length_m);
  CheckAbove(0, "course.width_m", width_m);
  CheckAbove(0, "course.line_spacing_m", line_spacing_m);
  CheckAbove(0, "course.laps", laps);
  CheckAtLeast(0, "course.along_index", along_index);
  CheckAtLeast(0, "course.along_start_m", along_start_m);
  CheckAtLeast(0, "course.sideways_m", sideways_m);
  CheckAtLeast(0, "course.kidnap_at_s", kidnap_at_s);
  CheckAtLeast(0, "course.kidnap_to_s", kidnap_to_s);
  if (kind == "climb")
    CheckOption(top_height_m > height_m, "course.top_height_m", top_height_m,
                "more than course.height_m");
  if (kind == "waypoints" && waypoints.empty())
    throw Error("option course.waypoints is empty: expected 'x y height; x y height; ...'");
}

}  // namespace deepuav
