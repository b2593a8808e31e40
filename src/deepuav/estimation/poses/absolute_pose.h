#pragma once

#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/poses/motion_only.h"

namespace deepuav {

struct AbsolutePoseOptions {
  double max_error_px = 4;    ///< Inlier bound of the robust estimate.
  double confidence = 0.999;  ///< Of the RANSAC.
  int max_iterations = 500;   ///< Fewer are done where they suffice to find min_inliers.
  int min_inliers = 12;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_error_px", max_error_px, "px", "reprojection error of an inlier of the robust pose",
          Above(0, 1000));
    visit("confidence", confidence, "", "confidence of the RANSAC", Within(0, 1));
    visit("max_iterations", max_iterations, "", "most samples of the RANSAC", Between(1, 10'000));
    visit("min_inliers", min_inliers, "", "fewest inliers of a pose that counts",
          Between(4, 100'000));
  }
};

struct AbsolutePose {
  SE3 cam_from_world;
  std::vector<uint8_t> inlier;  ///< One per observation.
  int inlier_count = 0;
};

/// The camera pose from 2-D to 3-D matches with outliers (P3P in a locally optimised RANSAC, its
/// samples drawn from `seed`). Nothing with fewer than min_inliers inliers in front of the
/// camera.
std::optional<AbsolutePose> EstimateAbsolutePose(const Pinhole& pinhole,
                                                 const std::vector<PoseObservation>& observations,
                                                 uint64_t seed, const AbsolutePoseOptions& options);

}  // namespace deepuav
