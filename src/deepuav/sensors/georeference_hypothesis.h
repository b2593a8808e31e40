#pragma once

#include <limits>
#include <vector>

#include "deepuav/geometry/sim3.h"
#include "deepuav/sensors/positions_on_path.h"

namespace deepuav {

using PathPositions = std::vector<PositionOnPath>;

/// A place of a path on Earth.
struct PathEstimate {
  Sim3 local_from_world;
  double clock_shift_s = 0;  ///< Beyond the offset that the positions were placed with.
};

/// How far the antenna of the estimated path is from a measured position; metres.
Eigen::Vector3d AntennaResidual(const PathEstimate& estimate, const PositionOnPath& at,
                                const Eigen::Vector3d& antenna_cam_m);

/// The lengths of all, in the standard deviations of the positions.
std::vector<double> AntennaDistances(const PathEstimate& estimate, const PathPositions& positions,
                                     const Eigen::Vector3d& antenna_cam_m);

/// Roughly where a camera has the ground: below it in the image, or ahead of it. Unit length.
Eigen::Vector3d DownByCameras(const PathPositions& positions);

struct PathHypothesis {
  PathEstimate estimate;
  double median = std::numeric_limits<double>::infinity();  ///< Of the distances.
};

/// The best of similarities through three positions each, by the median of the distances (Rousseeuw
/// 1984, least median of squares): it needs no standard deviation to be true. `down_world` tells
/// how three positions on a line lie about it. The same input gives the same result.
PathHypothesis BestHypothesis(const PathPositions& all, const Eigen::Vector3d& antenna_cam_m,
                              const Eigen::Vector3d& down_world);

/// Turned about the line from its beginning to the place farthest from there, so that the ground is
/// below it: fixes hardly tell how a path that is nearly straight lies about itself.
Sim3 Upright(const Sim3& local_from_world, const PathPositions& positions,
             const Eigen::Vector3d& down_world);

}  // namespace deepuav
