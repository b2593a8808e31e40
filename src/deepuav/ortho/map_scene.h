#pragma once

#include <vector>

#include "deepuav/io/maps/map_file.h"
#include "deepuav/ortho/ortho_view.h"
#include "deepuav/ortho/view_images.h"

namespace deepuav {

/// What of a map makes surface and orthophoto. Holds nothing of the map itself, which may go.
struct MapScene {
  OrthoScene scene;
  ViewImages images;  ///< By view.
  std::vector<Eigen::Vector3d>
      landmarks;  ///< World. Those that three views see where that are many.

  std::vector<Eigen::Vector3d> LandmarksOnGround() const;
};

/// Throws Error where the map has no keyframes or lies nowhere level (LevelFromWorld).
MapScene SceneOf(const LoadedAtlas& loaded, MapId map);

}  // namespace deepuav
