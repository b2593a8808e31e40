#pragma once

#include <cstdint>
#include <vector>

#include "deepuav/estimation/poses/absolute_pose.h"
#include "deepuav/estimation/two_views/three_view.h"
#include "deepuav/estimation/two_views/two_view.h"

namespace deepuav {

/// A point of two views in a third.
struct SeenThrice {
  size_t match = 0;  ///< Of the two views.
  PixelTriple px;
};

/// What a third view says of a solution of two.
struct Confirmation {
  int matched = 0, confirmed = 0;  ///< Points whose distance the first two views tell.
  double baseline_ratio = 0;       ///< Of the third view to the second, over that of the first two.
  std::vector<double> errors =
      {};  ///< Of all points seen, as WeightedErrors; 1 where the solution does not hold.
};

/// Places the third view by the points of known distance, adjusts all three and compares. `seed`:
/// of the robust pose.
Confirmation ConfirmBy(const Pinhole& pinhole, const TwoViewSolution& solution,
                       const std::vector<SeenThrice>& seen, uint64_t seed,
                       const TwoViewOptions& options, const AbsolutePoseOptions& pose_options);

/// Whether every other solution leaves errors that are `min_lead` times as large, squared and
/// truncated, by the points that any explains; the rest are wrong matches.
bool IsAlone(size_t best, const std::vector<Confirmation>& found, double min_lead);

/// The standard deviation of detected pixels by the solution that explains two views best: a lens
/// or a shutter that is not known adds to their noise. Infinite without a solution.
double LeastSigmaPx(const TwoViewResult& result);

}  // namespace deepuav
