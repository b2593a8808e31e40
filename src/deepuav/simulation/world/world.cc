#include "deepuav/simulation/world/world.h"

#include <algorithm>
#include <cmath>

#include "deepuav/simulation/world/world_geometry.h"

namespace deepuav {
namespace {

constexpr double kAboveEverythingM = 5000;
constexpr double kRoofThicknessM = 0.6;

}  // namespace

World::World(const SceneOptions& options, const std::vector<Marker>& markers)
    : geometry_(std::make_unique<WorldGeometry>(options, markers)) {}

World::~World() = default;

double World::GroundHeight(double x, double y) const {
  return geometry_->outdoors() != nullptr ? geometry_->outdoors()->terrain.Height(x, y) : 0;
}

double World::ClearanceHeight(double x, double y) const {
  const Eigen::Vector2d half = HalfExtent();
  const double inside_x = std::clamp(x, -half.x(), half.x());
  const double inside_y = std::clamp(y, -half.y(), half.y());
  const double from = CeilingHeight().value_or(kAboveEverythingM);
  const double ground = GroundHeight(inside_x, inside_y);
  return std::max(ground, geometry_->TopBelow(inside_x, inside_y, from).value_or(ground));
}

double World::ClearanceHeight(double x, double y, double radius_m) const {
  double highest = ClearanceHeight(x, y);
  const int steps = static_cast<int>(std::ceil(radius_m));
  for (int j = -steps; j <= steps; ++j) {
    for (int i = -steps; i <= steps; ++i) {
      const double dx = std::min<double>(i, radius_m), dy = std::min<double>(j, radius_m);
      if (std::hypot(dx, dy) <= radius_m)
        highest = std::max(highest, ClearanceHeight(x + dx, y + dy));
    }
  }
  return highest;
}

std::optional<double> World::CeilingHeight() const {
  if (geometry_->hall() == nullptr) return std::nullopt;
  return geometry_->hall()->ceiling_m - kRoofThicknessM;
}

Eigen::Vector2d World::HalfExtent() const {
  if (const Hall* hall = geometry_->hall(); hall != nullptr) return hall->half_extent_m;
  return Eigen::Vector2d::Constant(geometry_->outdoors()->terrain.half_extent_m());
}

const std::vector<Polyline>& World::roads() const { return geometry_->roads(); }
const std::vector<Polyline>& World::rivers() const { return geometry_->rivers(); }
const SceneOptions& World::options() const { return geometry_->options(); }

}  // namespace deepuav
