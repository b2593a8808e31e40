#pragma once

#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/io/geodata/trajectory.h"

namespace deepuav {

struct AssociationOptions {
  double max_difference_s = 0.01;  ///< Largest difference of two associated time stamps, seconds.
  double time_offset_s = 0;        ///< Added to the estimate's time stamps, seconds.
  bool one_to_one = false;  ///< Let no pose serve two partners: of several the nearest keeps it.
  bool interpolate =
      false;  ///< Compare at the moments of whichever has fewer, the other interpolated.
  double max_gap_s = 0.5;  ///< Longest gap between poses to interpolate in, seconds.

  /// Throws Error for a value that cannot be.
  void Check() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    // Seconds that stay within 64-bit nanoseconds, and lead from a video's 0 to a receiver's
    // Unix time.
    constexpr double kLongestSpan_s = 1e9, kLargestOffset_s = 4e9;
    visit("max_difference_s", max_difference_s, "s",
          "largest difference of two associated time stamps", Below(0, kLongestSpan_s));
    visit("time_offset_s", time_offset_s, "s", "added to the estimate's time stamps",
          Between(-kLargestOffset_s, kLargestOffset_s));
    visit("one_to_one", one_to_one, "", "let no pose serve two partners");
    visit("interpolate", interpolate, "",
          "interpolate at the moments of truth or estimate, the rarer");
    visit("max_gap_s", max_gap_s, "s", "longest gap between poses to interpolate in",
          Below(0, kLongestSpan_s));
  }
};

/// Indices into the two trajectories.
struct AssociatedPair {
  int truth = 0;
  int estimate = 0;

  bool operator==(const AssociatedPair&) const = default;
};

/// Pairs each pose of the trajectory with fewer poses (the estimate if equal) with the pose of the
/// other that is nearest in time, if no further than the limit; nothing is interpolated. It is the
/// rule of evo, under which a pose of the longer trajectory can serve several of the shorter,
/// unless `one_to_one`. Pairs come by growing time. Throws Error, naming the two time ranges, if
/// there is no pair.
std::vector<AssociatedPair> Associate(const Trajectory& truth, const Trajectory& estimate,
                                      const AssociationOptions& options = {});

/// Pose i of the one belongs to pose i of the other. Each carries the times of its own clock.
struct InterpolatedPairs {
  Trajectory truth, estimate;
  bool truth_is_interpolated = false;
};

/// Of truth and estimate, that of the shorter median interval (the estimate if equal) at those
/// moments of the other at which it can be had, as photographs seconds apart would cut the corners
/// of a receiver's path. Positions are interpolated linearly, orientations along the shortest turn,
/// between poses that are no further apart than `max_gap_s`; nothing is extrapolated. Throws Error,
/// naming the two time ranges, if no moment is left.
InterpolatedPairs InterpolateDenser(const Trajectory& truth, const Trajectory& estimate,
                                    const AssociationOptions& options = {});

/// How many pairs share a pose with an earlier pair.
int CountSharedPoses(const std::vector<AssociatedPair>& pairs);

}  // namespace deepuav
