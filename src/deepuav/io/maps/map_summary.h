#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "deepuav/base/time.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// What a map holds, in figures. Lengths are in the map's own unit.
struct MapSummary {
  int keyframes = 0, landmarks = 0;
  int removed_keyframes = 0;
  int64_t keypoints = 0;            ///< Of all keyframes.
  int64_t observations = 0;         ///< Of all landmarks.
  double median_observations = 0;   ///< Of one landmark; the mean of the two in the middle.
  int descriptor_dimension = 0;     ///< 0 where there are no keyframes.
  Timestamp first_time, last_time;  ///< Of the keyframes.
  double path_length = 0;           ///< From keyframe to keyframe in order of time.
  Eigen::AlignedBox3d cameras;      ///< Around the keyframes' positions; empty without any.
  Eigen::AlignedBox3d points;       ///< Around the landmarks.
};

MapSummary SummariseMap(const Map& map);

}  // namespace deepuav
