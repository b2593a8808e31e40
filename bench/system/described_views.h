#pragma once

#include <string>
#include <vector>

#include "deepuav/base/time.h"
#include "deepuav/features/descriptors.h"
#include "deepuav/geometry/timed_pose.h"
#include "deepuav/io/datasets/dataset.h"

namespace deepuav {

/// A frame's descriptors as it is, then turned by 90, 180 and 270 degrees if asked for.
using Headings = std::vector<Descriptors>;

struct View {
  Timestamp time;
  SE3 world_from_cam;
  Headings headings;
};

/// Which frames are described, and with what.
struct ViewOptions {
  std::string model;  ///< SuperPoint network.
  int stride = 5, keypoints = 1000;
  bool turned = false;
};

/// The frames that can be read and have a true pose.
std::vector<View> LoadViews(Dataset* dataset, const Trajectory& truth, const ViewOptions& options);

}  // namespace deepuav
