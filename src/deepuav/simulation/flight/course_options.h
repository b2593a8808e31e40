#pragma once

#include <string>

#include "deepuav/base/option_bounds.h"

namespace deepuav {

/// The longest time that a course takes, and that is recorded.
inline constexpr double kLongestFlightS = 3600;

/// Where a flight leads, and how fast.
struct CourseOptions {
  std::string kind = "orbit";
  double center_x_m = 0;
  double center_y_m = 0;
  double heading_deg = 0;
  double height_m = 30;
  double top_height_m = 200;
  double clearance_m = 5;
  double speed_m_s = 6;
  double acceleration_m_s2 = 3;
  double yaw_rate_deg_s = 60;
  double radius_m = 50;
  double length_m = 150;
  double width_m = 60;
  double line_spacing_m = 25;
  bool cross_lines = true;
  double laps = 1;
  std::string along = "road";
  int along_index = 0;
  double along_start_m = 0;
  std::string yaw = "auto";
  double yaw_offset_deg = 0;
  double sideways_m = 0;
  std::string waypoints;
  double kidnap_at_s = 0;
  double kidnap_to_s = 0;

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    constexpr double kFarthestM = 10'000, kMostTurnDeg = 3600;
    visit("kind", kind, "",
          "orbit, corridor (along a road or river), circuit (a rectangle), figure_eight, survey "
          "(lines to and fro), climb (up and down again) or waypoints",
          OneOf({"orbit", "corridor", "circuit", "figure_eight", "survey", "climb", "waypoints"}));
    visit("center_x_m", center_x_m, "m", "middle of the course, east; of waypoints their origin",
          Between(-kFarthestM, kFarthestM));
    visit("center_y_m", center_y_m, "m", "the same, north", Between(-kFarthestM, kFarthestM));
    visit("heading_deg", heading_deg, "deg",
          "direction of circuit, figure_eight and survey's lines, from east to north",
          Between(-kMostTurnDeg, kMostTurnDeg));
    visit("height_m", height_m, "m", "above the ground: at the start, in a corridor all along",
          Above(0, kFarthestM));
    visit("top_height_m", top_height_m, "m", "to which a climb leads", Above(0, kFarthestM));
    visit("clearance_m", clearance_m, "m",
          "kept above all that stands below; the course rises for it", Between(0, kFarthestM));
    visit("speed_m_s", speed_m_s, "m/s", "highest speed", Between(0.1, 100));
    visit("acceleration_m_s2", acceleration_m_s2, "m/s^2", "highest acceleration",
          Between(0.1, 100));
    visit("yaw_rate_deg_s", yaw_rate_deg_s, "deg/s", "fastest turn of the heading",
          Between(0.1, 3600));
    visit("radius_m", radius_m, "m", "of an orbit, and of a climb's spiral", Above(0, kFarthestM));
    visit("length_m", length_m, "m", "of corridor, circuit, figure_eight and survey's lines",
          Above(0, kFarthestM));
    visit("width_m", width_m, "m", "of circuit, figure_eight and the surveyed area",
          Above(0, kFarthestM));
    visit("line_spacing_m", line_spacing_m, "m", "between a survey's lines",
          Between(0.1, kFarthestM));
    visit("cross_lines", cross_lines, "", "survey a second time at right angles");
    visit("laps", laps, "", "of orbit, circuit, figure_eight, and of a climb's spiral upwards",
          Above(0, 1000));
    visit("along", along, "", "what a corridor follows", OneOf({"road", "river"}));
    visit("along_index", along_index, "", "which of them, from 0, the longest first",
          Between(0, 1000));
    visit("along_start_m", along_start_m, "m", "from its beginning to the corridor's",
          Between(0, kFarthestM));
    visit("yaw", yaw, "",
          "where the body's front points: course, center, fixed (along heading_deg), or auto: what "
          "suits the kind",
          OneOf({"auto", "course", "center", "fixed"}));
    visit("yaw_offset_deg", yaw_offset_deg, "deg", "added to it, to the left",
          Between(-kMostTurnDeg, kMostTurnDeg));
    visit("sideways_m", sideways_m, "m", "flown to the right at first, before the course begins",
          Between(0, kFarthestM));
    visit("waypoints", waypoints, "",
          "'x y height [pause_s [turn_deg]]; ...': metres from the middle and above the ground "
          "there; "
          "with a pause it stops there and turns to the left");
    visit("kidnap_at_s", kidnap_at_s, "s", "moment of a jump along the course, 0 for none",
          Between(0, kLongestFlightS));
    visit("kidnap_to_s", kidnap_to_s, "s", "time along the course at which it goes on",
          Between(0, kLongestFlightS));
  }
};

}  // namespace deepuav
