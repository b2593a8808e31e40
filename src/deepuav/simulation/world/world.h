#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "deepuav/simulation/world/scene_options.h"

namespace deepuav {

/// The middle line of a road or river on the ground, world frame, metres.
struct Polyline {
  std::vector<Eigen::Vector3d> points;
  double width_m = 0;
};

/// A small bright sphere, for tests of the truth.
struct Marker {
  Eigen::Vector3d position;
  double radius_m = 0.1;
};

class WorldGeometry;

/// The world that is flown over: static geometry, and cars and people whose position is a function
/// of time alone. World frame: z up, x east, y north, metres, origin in the middle of the terrain
/// at height 0 (not always on the ground: see GroundHeight). Const after construction and safe to
/// share between threads.
class World {
 public:
  /// Throws Error for options out of range and image files that cannot be read.
  explicit World(const SceneOptions& options, const std::vector<Marker>& markers = {});
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  /// The terrain (bed or surface of water, floor of the hall) at a place. Outside the extent: that
  /// of the nearest place inside.
  double GroundHeight(double x, double y) const;

  /// The top of whatever stands there, standing trees and buildings included, moving things not
  /// (they stay under GroundHeight + 4.5). In a hall what stands on the floor, not the roof.
  double ClearanceHeight(double x, double y) const;

  /// The highest ClearanceHeight within `radius_m`, sampled every metre.
  double ClearanceHeight(double x, double y, double radius_m) const;

  /// The lowest point of the roof, in a hall.
  std::optional<double> CeilingHeight() const;

  /// |x| and |y| of the world stay within these (half the sides of the terrain, or of the hall).
  Eigen::Vector2d HalfExtent() const;

  /// Roads, longest first, and rivers. Empty in a hall.
  const std::vector<Polyline>& roads() const;
  const std::vector<Polyline>& rivers() const;

  const SceneOptions& options() const;

  /// What the renderer traces.
  const WorldGeometry& geometry() const { return *geometry_; }

 private:
  std::unique_ptr<const WorldGeometry> geometry_;
};

}  // namespace deepuav
