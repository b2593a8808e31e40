#include "deepuav/evaluation/measures/ate.h"

#include "deepuav/base/error.h"
#include "deepuav/sensors/lever_arm.h"

namespace deepuav {
namespace {

constexpr size_t kFewestToAlign = 3;

Sim3 AlignOrThrow(const Trajectory& truth, const Trajectory& estimate, AlignmentKind kind,
                  const Eigen::Vector3d& antenna_cam_m) {
  if (truth.size() < kFewestToAlign) {
    throw Error("{} associated poses are too few to align: expected at least {}", truth.size(),
                kFewestToAlign);
  }
  const std::optional<Sim3> aligned = AlignWithLeverArm(truth, estimate, kind, antenna_cam_m);
  if (!aligned) {
    throw Error(
        "The {} associated positions do not determine the alignment: they lie in one point or on "
        "one line",
        truth.size());
  }
  return *aligned;
}

}  // namespace

AbsoluteError ComputeAbsoluteError(const Trajectory& truth, const Trajectory& estimate,
                                   std::optional<AlignmentKind> kind, bool horizontal,
                                   const Eigen::Vector3d& antenna_cam_m) {
  if (truth.size() != estimate.size()) {
    throw Error("{} poses of truth do not pair with {} of the estimate", truth.size(),
                estimate.size());
  }
  if (truth.empty()) throw Error("There is no pose to compare");
  AbsoluteError result;
  if (kind) result.truth_from_estimate = AlignOrThrow(truth, estimate, *kind, antenna_cam_m);
  const Trajectory moved = MoveToAntenna(result.truth_from_estimate, estimate, antenna_cam_m);
  result.errors_m.reserve(truth.size());
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < truth.size(); ++i) {
    Eigen::Vector3d difference =
        moved[i].world_from_cam.translation() - truth[i].world_from_cam.translation();
    if (horizontal) difference.z() = 0;
    result.errors_m.push_back(difference.norm());
    squares += difference.cwiseAbs2();
  }
  result.rms_along_axes_m = (squares / static_cast<double>(truth.size())).cwiseSqrt();
  result.statistics_m = ComputeStatistics(result.errors_m);
  return result;
}

}  // namespace deepuav
