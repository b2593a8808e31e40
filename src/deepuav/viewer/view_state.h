#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/base/time.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/image/image.h"

namespace deepuav {

/// What is shown of a frame.
struct FrameView {
  FrameId id;
  Timestamp time;
  std::string state, reason;  ///< "tracked", "lost", ...; why there is no pose.
  std::optional<SE3> world_from_cam;
  int64_t map = -1;  ///< Of the pose.
  int key_points = 0, landmarks = 0;
  GreyImage image;                            ///< Shared, not changed any more; empty: none.
  std::vector<Eigen::Vector2f> landmarks_px;  ///< In the image, which may be shown smaller...
  int width_px = 0, height_px = 0;            ///< ...than these.
};

/// What is shown of a map.
struct MapView {
  int64_t map = -1;
  std::vector<Eigen::Vector3f> points;  ///< Evenly thinned out.
  int landmarks = 0, keyframes = 0;     ///< All of them.
  std::vector<SE3> world_from_keyframes;
  std::vector<Eigen::Vector3f> path;  ///< Of the frames, by time.
  /// Where the keyframes are that closed loops tie, two by two; evenly thinned out.
  std::vector<std::array<Eigen::Vector3f, 2>> loops;
  Eigen::Vector3f up{0, -1, 0};  ///< Along an axis of the world.
};

/// What is shown of where the images come from.
struct FeedView {
  std::string link;  ///< "open", "dropped", "ended", ...; empty: not known.
  int64_t arrived = 0, skipped = 0, reconnects = 0;
  double latency_ms = 0, latency_p95_ms = 0;
};

}  // namespace deepuav
