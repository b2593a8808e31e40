#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/geometry/se3.h"
#include "deepuav/map/gauge.h"

namespace deepuav {

/// The coordinates in which the ground lies level: x to the right of a raster (east), y up on it
/// (north), z is height. Both functions are safe to be called from several threads.
struct GroundFrame {
  std::function<Eigen::Vector3d(const Eigen::Vector3d&)> ground_from_world, world_from_ground;
  std::optional<int> epsg;  ///< Where these are the coordinates of a projected system, in metres.
  std::string about;        ///< For a person: "UTM zone 32N", ...
};

/// The turn that lays the plane through most of the points level, the cameras above it, and keeps
/// the direction of x as far as it can. Throws Error where the points tell no plane.
SE3 LevelFromWorld(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<Eigen::Vector3d>& cameras);

/// Of a map whose world means `gauge`: UTM and ellipsoidal heights where it lies on Earth; the
/// map's own axes where z is up; else turned level by LevelFromWorld, which it throws as.
GroundFrame MakeGroundFrame(const Gauge& gauge, const std::vector<Eigen::Vector3d>& points,
                            const std::vector<Eigen::Vector3d>& cameras);

}  // namespace deepuav
