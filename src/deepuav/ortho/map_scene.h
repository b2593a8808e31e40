#pragma once

#include <memory>
#include <vector>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/io/maps/map_file.h"
#include "deepuav/ortho/ortho_view.h"
#include "deepuav/ortho/photographs.h"

namespace deepuav {

/// What of a map makes surface and orthophoto. Holds nothing of the map itself, which may go.
struct MapScene {
  OrthoScene scene;
  std::vector<std::string> names;  ///< By view: the image's, empty where it is not known.
  std::vector<Timestamp> times;    ///< By view.
  std::vector<Eigen::Vector3d>
      landmarks;  ///< World. Those that three views see where that are many.

  std::vector<Eigen::Vector3d> LandmarksOnGround() const;
};

/// Throws Error where the map has no keyframes or lies nowhere level (LevelFromWorld).
MapScene SceneOf(const LoadedAtlas& loaded, MapId map);

/// The views' images out of a dataset that has them, by name and time. Throws Error where it has
/// none of them; `dataset` stays with it.
std::unique_ptr<Photographs> PhotographsOf(const MapScene& scene, std::unique_ptr<Dataset> dataset);

}  // namespace deepuav
