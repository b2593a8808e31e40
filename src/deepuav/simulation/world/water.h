#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/simulation/world/scene_options.h"

namespace deepuav {

/// Where the river and the lake lie. Their surface is at height 0.
class Water {
 public:
  explicit Water(const SceneOptions& options);

  /// Distance to the nearest shore, m: negative in the water; large where there is none.
  float ShoreDistance(float x, float y) const;

  bool any() const { return river_half_width_ > 0 || lake_radius_ > 0; }

  /// The middle of the river across the terrain; empty without one.
  std::vector<Eigen::Vector2d> RiverLine() const;

  bool InLake(const Eigen::Vector2d& point) const;

 private:
  float RiverOffset(float along) const;
  float LakeShoreDistance(const Eigen::Vector2f& point) const;

  float half_extent_;
  float river_half_width_, river_shift_, river_swing_;
  Eigen::Vector2f river_along_, river_across_;
  float lake_radius_;
  Eigen::Vector2f lake_centre_;
  uint32_t seed_;
};

}  // namespace deepuav
