#include "deepuav/simulation/flight/course_outline.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Points2 = std::vector<Eigen::Vector2d>;

constexpr int kPointsPerTurn = 180;
constexpr double kRadiansPerDegree = std::numbers::pi / 180;

std::string_view TakeUntil(std::string_view* text, char separator) {
  const size_t end = std::min(text->find(separator), text->size());
  const std::string_view head = text->substr(0, end);
  text->remove_prefix(std::min(end + 1, text->size()));
  return head;
}

std::vector<double> ReadNumbers(std::string_view text) {
  std::vector<double> numbers;
  while (!text.empty()) {
    const std::string_view word = TakeUntil(&text, ' ');
    if (word.empty()) continue;
    double number = 0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (status != std::errc() || end != word.data() + word.size() || !std::isfinite(number))
      throw Error("option course.waypoints holds '{}': expected a number", word);
    numbers.push_back(number);
  }
  return numbers;
}

// The part of a polyline from `start` along it, `length` long or to its end.
template <typename Point>
std::vector<Point> Section(const std::vector<Point>& points, double start, double length) {
  std::vector<Point> section;
  double from = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    const double to = from + (points[i] - points[i - 1]).norm();
    const auto at = [&](double along) -> Point {
      return points[i - 1] + (points[i] - points[i - 1]) * ((along - from) / (to - from));
    };
    if (to > start && from < start + length) {
      if (section.empty()) section.push_back(at(std::max(from, start)));
      section.push_back(at(std::min(to, start + length)));
    }
    from = to;
  }
  return section;
}

class Outliner {
 public:
  Outliner(const CourseOptions& course, const World& world)
      : course_(course),
        world_(world),
        centre_(course.center_x_m, course.center_y_m),
        heading_(course.heading_deg * kRadiansPerDegree) {}

  std::vector<OutlineLeg> Outline() const {
    if (course_.kind == "corridor") return {{AlongGround(Corridor())}};
    if (course_.kind == "climb") return {{Climb()}};
    if (course_.kind == "waypoints") return Waypoints();
    if (course_.kind == "orbit") return {{Level(Orbit())}};
    if (course_.kind == "circuit") return {{Level(Circuit())}};
    if (course_.kind == "figure_eight") return {{Level(FigureEight())}};
    return {{Level(Survey())}};
  }

 private:
  // From coordinates about the middle, x along the heading.
  Eigen::Vector2d Place(double x, double y) const {
    return centre_ + Eigen::Rotation2Dd(heading_) * Eigen::Vector2d(x, y);
  }

  std::vector<Eigen::Vector3d> Level(const Points2& places) const {
    const double z = world_.GroundHeight(centre_.x(), centre_.y()) + course_.height_m;
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector2d& place : places) points.emplace_back(place.x(), place.y(), z);
    return points;
  }

  std::vector<Eigen::Vector3d> AlongGround(const std::vector<Eigen::Vector3d>& on_ground) const {
    std::vector<Eigen::Vector3d> points = on_ground;
    for (Eigen::Vector3d& point : points)
      point.z() = world_.GroundHeight(point.x(), point.y()) + course_.height_m;
    return points;
  }

  Points2 Orbit() const {
    Points2 places;
    const int steps = static_cast<int>(std::ceil(course_.laps * kPointsPerTurn));
    for (int i = 0; i <= steps; ++i) {
      const double angle = 2 * std::numbers::pi * course_.laps * i / steps;
      places.push_back(
          Place(course_.radius_m * std::cos(angle), course_.radius_m * std::sin(angle)));
    }
    return places;
  }

  Points2 FigureEight() const {
    Points2 places;
    const int steps = static_cast<int>(std::ceil(course_.laps * kPointsPerTurn));
    for (int i = 0; i <= steps; ++i) {
      const double angle = 2 * std::numbers::pi * course_.laps * i / steps;
      places.push_back(
          Place(course_.length_m / 2 * std::sin(angle), course_.width_m / 2 * std::sin(2 * angle)));
    }
    return places;
  }

  Points2 Circuit() const {
    const double x = course_.length_m / 2, y = course_.width_m / 2;
    Points2 places{Place(0, -y)};
    const int rounds = static_cast<int>(std::ceil(course_.laps));
    for (int i = 0; i < rounds; ++i) {
      for (const auto& [cx, cy] : {std::pair(x, -y), {x, y}, {-x, y}, {-x, -y}, {0.0, -y}})
        places.push_back(Place(cx, cy));
    }
    return Section(places, 0, course_.laps * 2 * (course_.length_m + course_.width_m));
  }

  // Lines to and fro along one side of an area, the first at (from_x, from_y) of its corners.
  static void AddLines(double half_length, double half_width, double spacing, bool along_x,
                       Eigen::Vector2d corner, Points2* places) {
    const int lines = 1 + static_cast<int>(std::floor(2 * half_width / spacing));
    Eigen::Vector2d along(along_x ? -2 * std::copysign(half_length, corner.x()) : 0,
                          along_x ? 0 : -2 * std::copysign(half_length, corner.y()));
    const Eigen::Vector2d across(along_x ? 0 : -std::copysign(spacing, corner.x()),
                                 along_x ? -std::copysign(spacing, corner.y()) : 0);
    for (int i = 0; i < lines; ++i) {
      places->push_back(corner);
      places->push_back(corner + along);
      corner += along + across;
      along = -along;
    }
  }

  Points2 Survey() const {
    const double x = course_.length_m / 2, y = course_.width_m / 2;
    Points2 places;
    AddLines(x, y, course_.line_spacing_m, true, {-x, -y}, &places);
    if (course_.cross_lines) {
      const Eigen::Vector2d corner(std::copysign(x, places.back().x()), y);
      AddLines(y, x, course_.line_spacing_m, false, corner, &places);
    }
    for (Eigen::Vector2d& place : places) place = Place(place.x(), place.y());
    return places;
  }

  std::vector<Eigen::Vector3d> Climb() const {
    std::vector<Eigen::Vector3d> points;
    const double ground = world_.GroundHeight(centre_.x(), centre_.y());
    const int steps = static_cast<int>(std::ceil(course_.laps * kPointsPerTurn));
    for (int i = 0; i <= 2 * steps; ++i) {
      const double share = static_cast<double>(i) / steps;  // 1 at the top, 2 below again
      const double angle = 2 * std::numbers::pi * course_.laps * share;
      const double rise = 1 - std::abs(1 - share);
      const Eigen::Vector2d place =
          Place(course_.radius_m * std::cos(angle), course_.radius_m * std::sin(angle));
      points.emplace_back(
          place.x(), place.y(),
          ground + course_.height_m + rise * (course_.top_height_m - course_.height_m));
    }
    return points;
  }

  std::vector<Eigen::Vector3d> Corridor() const {
    const std::vector<Polyline>& lines = course_.along == "road" ? world_.roads() : world_.rivers();
    const auto index = static_cast<size_t>(course_.along_index);
    if (index >= lines.size()) {
      throw Error("option course.along_index is {}: the scene has {} {}s, counted from 0", index,
                  lines.size(), course_.along);
    }
    std::vector<Eigen::Vector3d> section =
        Section(lines[index].points, course_.along_start_m, course_.length_m);
    if (section.size() < 2) {
      throw Error("option course.along_start_m is {}: expected less than the length of {} {}",
                  course_.along_start_m, course_.along, index);
    }
    return section;
  }

  std::vector<OutlineLeg> Waypoints() const {
    std::vector<OutlineLeg> legs(1);
    std::string_view rest = course_.waypoints;
    while (!rest.empty()) {
      const std::vector<double> numbers = ReadNumbers(TakeUntil(&rest, ';'));
      if (numbers.empty()) continue;
      if (numbers.size() < 3 || numbers.size() > 5) {
        throw Error(
            "option course.waypoints has a waypoint of {} numbers: expected 'x y height [pause_s "
            "[turn_deg]]'",
            numbers.size());
      }
      const Eigen::Vector2d place = centre_ + Eigen::Vector2d(numbers[0], numbers[1]);
      const Eigen::Vector3d point(place.x(), place.y(),
                                  world_.GroundHeight(place.x(), place.y()) + numbers[2]);
      legs.back().points.push_back(point);
      if (numbers.size() == 3 || legs.back().points.size() == 1) continue;
      legs.back().pause_s = numbers[3];
      legs.back().turn_rad = numbers.size() == 5 ? numbers[4] * kRadiansPerDegree : 0;
      legs.push_back({{point}});
    }
    if (legs.back().points.size() < 2) legs.pop_back();
    if (legs.empty()) throw Error("option course.waypoints has less than two waypoints");
    return legs;
  }

  const CourseOptions& course_;
  const World& world_;
  const Eigen::Vector2d centre_;
  const double heading_;
};

}  // namespace

std::vector<OutlineLeg> OutlineCourse(const CourseOptions& course, const World& world) {
  return Outliner(course, world).Outline();
}

}  // namespace deepuav
