#pragma once

#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/scene_options.h"

namespace deepuav {

/// A hall as of a warehouse: walls with posters, pillars, shelves with boxes, and strips of roof
/// light through which the sun falls. Its floor is at height 0; x runs along it.
struct Hall {
  FaceMesh mesh;
  Eigen::Vector2d half_extent_m;
  double ceiling_m;
};

Hall MakeHall(const SceneOptions& options);

}  // namespace deepuav
