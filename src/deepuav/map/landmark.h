#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/geometry/pixel_measurement.h"

namespace deepuav {

/// A keyframe's key point that shows the landmark.
struct Observation {
  KeyframeId keyframe;
  int keypoint = 0;
  PixelMeasurement measured = {};  ///< The key point's position, or a better one.
};

/// A point of the map.
struct Landmark {
  LandmarkId id;
  Eigen::Vector3d position_world = Eigen::Vector3d::Zero();
  std::vector<Observation> observations;  ///< By keyframe id; at most one a keyframe.
  KeyframeId created_by;                  ///< The newest keyframe when it was made.

  /// Where it can be recognised from: the mean direction from landmark to cameras, and their
  /// distances.
  Eigen::Vector3d mean_view_direction = Eigen::Vector3d::Zero();
  double min_distance = 0, max_distance = 0;
  /// Of the surface that it lies on, towards those who see it; zero: not known.
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();
  Observation representative;  ///< Whose descriptor stands for the landmark.

  int visible = 0;  ///< Frames whose view it was predicted to be in.
  int found = 0;    ///< Of these, those that matched it.

  /// As well as it is known: where nothing tells, surfaces face those who see them.
  const Eigen::Vector3d& SurfaceNormal() const {
    return normal_world.isZero(0) ? mean_view_direction : normal_world;
  }
};

}  // namespace deepuav
