#pragma once

#include <optional>
#include <vector>

#include "deepuav/evaluation/measures/statistics.h"
#include "deepuav/geometry/alignment.h"
#include "deepuav/io/geodata/trajectory.h"

namespace deepuav {

/// The absolute trajectory error (Sturm et al. 2012): distances of positions after alignment.
struct AbsoluteError {
  Sim3 truth_from_estimate;      ///< The alignment; identity for none.
  std::vector<double> errors_m;  ///< One per pose.
  Eigen::Vector3d rms_along_axes_m = Eigen::Vector3d::Zero();  ///< Along x, y and z of the truth.
  ErrorStatistics statistics_m;
};

/// Compares pose i of `truth` with pose i of `estimate`, after the estimate was moved by the
/// alignment of `kind` (nothing: as it is). `horizontal`: the error is the distance in x and y
/// alone, that along z being 0; the alignment stays the three-dimensional one. `antenna_cam_m`: the
/// truth is the path of this point of the camera, metres. Throws Error if the sizes differ, there
/// is no pose, or the positions do not determine the alignment.
AbsoluteError ComputeAbsoluteError(const Trajectory& truth, const Trajectory& estimate,
                                   std::optional<AlignmentKind> kind, bool horizontal = false,
                                   const Eigen::Vector3d& antenna_cam_m = Eigen::Vector3d::Zero());

}  // namespace deepuav
