#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/evaluation/measures/association.h"
#include "deepuav/evaluation/measures/ate.h"
#include "deepuav/evaluation/measures/rpe.h"
#include "deepuav/evaluation/measures/truth.h"

namespace deepuav {

struct EvaluationOptions {
  AssociationOptions association;
  std::optional<AlignmentKind> alignment =
      AlignmentKind::kSimilar;  ///< Nothing: compare as they are.
  bool horizontal = false;      ///< Position errors in x and y alone.
  RpeOptions rpe;
  double search_offset_s = 0;  ///< Search the time offset this far around association's, seconds;
                               ///< 0: take that as it is.
  std::optional<Eigen::Vector3d>
      antenna_cam_m;  ///< Point of the camera whose path the truth is, metres in the camera's axes;
                      ///< nothing: the truth's own.
  double start_s =
      0;  ///< Part of the truth to use: from here on, seconds from its first time stamp,
  double end_s = std::numeric_limits<double>::infinity();  ///< to here.

  /// Throws Error for a value that cannot be.
  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;

  template <typename Visitor>
  void Visit(Visitor&& visit) {
    constexpr double kLongest_s = 1e9;
    visit("horizontal", horizontal, "", "position errors in x and y alone");
    visit("search_offset_s", search_offset_s, "s", "search the time offset this far both ways",
          Between(0, kLongest_s));
    visit("start_s", start_s, "s", "start of the part to evaluate, from the first truth",
          Between(0, kLongest_s));
    visit("end_s", end_s, "s", "end of the part to evaluate, from the first truth",
          Above(0, std::numeric_limits<double>::infinity()));
    visit.Part("", association);
    visit.Part("rpe", rpe);
  }
};

/// How well an estimate agrees with the truth.
struct Evaluation {
  Trajectory truth;             ///< All poses of the part evaluated.
  int estimate_poses = 0;       ///< All poses of the estimate in that part.
  Trajectory matched_truth;     ///< One pose a pair.
  Trajectory matched_estimate;  ///< One pose a pair, aligned; times as in the estimate's file.
  int shared_poses = 0;         ///< Pairs that share a pose with another pair.
  double time_offset_s = 0;     ///< Added to the estimate's times: as found, where searched.
  bool interpolated = false;    ///< Compared at the moments of either, not at the nearest poses.
  bool truth_is_interpolated = false;  ///< At the estimate's moments; else the other way.
  bool horizontal = false;             ///< Errors are of x and y alone.
  bool z_is_up = false;                ///< In the truth, which is known of some only.
  Eigen::Vector3d antenna_cam_m = Eigen::Vector3d::Zero();
  AbsoluteError ate;
  std::optional<RelativeError> rpe;  ///< Nothing where no two poses are the step apart.

  /// The part of the truth's poses that has an estimate, in 0..1; of an interpolated truth those
  /// between poses of the estimate.
  double Completeness() const;
  /// The truth's path from the first pose that has an estimate to the last, metres.
  double ComparedPathM() const;
};

double PathLengthM(const Trajectory& trajectory);

/// The point of the camera whose path the truth is, metres.
Eigen::Vector3d AntennaOf(const Truth& truth, const EvaluationOptions& options);

/// Searches the time offset if asked to, associates, aligns and compares. The estimate is
/// interpolated where options say so, where the time offset is searched and for a truth with a
/// clock of its own; errors are horizontal where options say so and for a truth without altitude.
/// Throws Error if nothing can be associated or the alignment is not determined.
Evaluation EvaluateTrajectory(const Truth& truth, const Trajectory& estimate,
                              const EvaluationOptions& options = {});

}  // namespace deepuav
