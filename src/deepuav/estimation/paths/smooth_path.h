#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/paths/smooth_motion.h"
#include "deepuav/estimation/poses/motion_only.h"

namespace deepuav {

/// A frame of a path: where it seems to be, and how well that is known.
struct PathPose {
  double time_s = 0;
  SE3 cam_from_world;
  bool is_known = false;  ///< It stays where it is.
  /// Inverse covariance of the twist [translation; rotation] that moves it from the left.
  Matrix6d information = Matrix6d::Zero();
  MotionNoise to_next = {};  ///< How unsteadily the camera moves from here to the next one.
};

struct SmoothPathOptions {
  bool enabled = true;
  int iterations = 10;         ///< Gauss-Newton steps.
  double chi_square = 12.592;  ///< 95 % of an error of six numbers: the loss grows linearly beyond.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "at the end, weigh each frame's own pose against how the camera moves");
    visit("iterations", iterations, "", "most Gauss-Newton steps of a smoothed path",
          Between(1, 100));
    visit("chi_square", chi_square, "",
          "squared error of a pose in standard deviations from which the loss grows linearly",
          Above(0, 1e6));
  }
};

/// The most probable poses of a camera that moves with white noise on its acceleration (Barfoot et
/// al. 2014), by growing time: poses that are well known stay as they are, the others follow from
/// what comes before and after. Huber loss; the equations are block tridiagonal, so the time grows
/// with the length of the path. Nothing where there are fewer than three poses, the noise of a step
/// is not usable, or the equations have no finite solution.
std::optional<std::vector<SE3>> SmoothPath(std::span<const PathPose> path,
                                           const SmoothPathOptions& options);

}  // namespace deepuav
