#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/geometry/pixel_measurement.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/map/frame.h"
#include "deepuav/map/keyframe.h"

namespace deepuav {

struct LandmarkMatch {
  int keypoint = 0;
  LandmarkId landmark;
  std::optional<PixelMeasurement> measured = {};  ///< Nothing: at the key point.
};

/// How often a landmark was predicted into a frame, and matched there, since the last request.
struct ViewCount {
  LandmarkId landmark;
  int visible = 0, found = 0;
};

/// What the Tracker sends the Mapper when a frame shall become a keyframe. The pose is relative to
/// a keyframe of the map, because the map may have moved since the Tracker saw it.
struct KeyframeRequest {
  MapId map;
  Frame frame;
  AnchoredPose pose;
  std::vector<LandmarkMatch> matches;
  std::vector<ViewCount> views;
};

/// Another pose for a keyframe, with all that it sees from there.
struct KeyframeRelocation {
  KeyframeId keyframe;
  SE3 cam_from_world;
  Frame frame;  ///< Corrected for how the camera moved along that path while it was read.
  std::vector<LandmarkMatch> matches;
};

/// Two views and what they see: the beginning of a map. Unit: the baseline, or any other.
struct InitialMapRequest {
  struct Point {
    Eigen::Vector3d position_first;  ///< In the first camera.
    int keypoint_first = 0, keypoint_second = 0;
  };
  Frame first, second;
  SE3 second_from_first;
  std::vector<Point> points;
};

}  // namespace deepuav
