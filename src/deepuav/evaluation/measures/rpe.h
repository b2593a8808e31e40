#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/evaluation/measures/statistics.h"
#include "deepuav/io/geodata/trajectory.h"

namespace deepuav {

enum class RpeUnit { kFrames, kMetres, kSeconds };

struct RpeOptions {
  double delta = 1;                 ///< The step over which motion is compared, in `unit`.
  RpeUnit unit = RpeUnit::kFrames;  ///< Frames count associated poses; metres run along the path.
  bool all_pairs = false;           ///< A pair from every pose, instead of end to end.
  bool pairs_from_truth = false;    ///< Measure metres along the truth, not the estimate.
  double relative_tolerance = 0.1;  ///< A pair's step may differ by this part of delta: where the
                                    ///< step is in seconds, and in metres with all_pairs.

  /// Throws Error for a value that cannot be.
  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("delta", delta, "", "step over which motion is compared", Above(0, 1e9));
    visit("all_pairs", all_pairs, "", "a pair from every pose, instead of end to end");
    visit("pairs_from_truth", pairs_from_truth, "", "measure metres along the truth");
    visit("relative_tolerance", relative_tolerance, "", "accepted deviation as a part of delta",
          Below(0, 1));
  }
};

/// The indices (i, j), i < j, of the poses whose relative motion is compared.
using PosePairs = std::vector<std::pair<int, int>>;
PosePairs SelectPosePairs(const Trajectory& trajectory, const RpeOptions& options);

/// The relative pose error (Sturm et al. 2012).
struct RelativeError {
  PosePairs pairs;
  std::vector<double> errors_m;    ///< One a pair.
  std::vector<double> errors_deg;  ///< One a pair; none where the truth has no orientation.
  ErrorStatistics translation_m;
  std::optional<ErrorStatistics> rotation_deg;  ///< Nothing where the truth has no orientation.
};

/// E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) of truth Q and aligned estimate P; its translation's length and
/// its rotation's angle. With `horizontal` the length is that in the truth's x and y alone. Pose i
/// of one belongs to pose i of the other. Nothing if no pair of poses is `delta` apart. Throws
/// Error if sizes differ.
std::optional<RelativeError> ComputeRelativeError(const Trajectory& truth,
                                                  const Trajectory& aligned_estimate,
                                                  const RpeOptions& options,
                                                  bool horizontal = false);

/// For truth without orientation: the difference of the distances |p_j - p_i|, in x and y alone if
/// `horizontal`.
std::optional<RelativeError> ComputeRelativeDistanceError(const Trajectory& truth,
                                                          const Trajectory& aligned_estimate,
                                                          const RpeOptions& options,
                                                          bool horizontal = false);

}  // namespace deepuav
