#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// How a camera moved while a rolling shutter read an image: from the first row to the last, in the
/// camera's axes of the middle row. Travelling is taken to be uniform meanwhile.
struct ReadoutMotion {
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< Rotation vector.
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();    ///< Of its centre, in map units.
  /// By how much a camera that shakes turns faster or slower in the course of it: see TurnAt.
  Eigen::Vector3d bend_rad = Eigen::Vector3d::Zero();

  bool IsNone() const { return turn_rad.isZero(0) && bend_rad.isZero(0) && travel.isZero(0); }
  bool TurnsAs(const ReadoutMotion& other) const {
    return turn_rad == other.turn_rad && bend_rad == other.bend_rad;
  }
  /// Rotation vector of the axes of the row read at a RowMoment, seen from those of the middle row.
  Eigen::Vector3d TurnAt(double moment) const { return moment * (turn_rad + moment * bend_rad); }
};

/// Of a camera that moves on as it did between two moments, in its axes at the second one.
ReadoutMotion MotionInReadout(const SE3& before_from_world, const SE3& now_from_world,
                              double between_s, double readout_s);

/// How a camera moves in a readout of so many seconds that moves so in one of one second.
ReadoutMotion InReadout(const ReadoutMotion& motion_per_s, double readout_s);

/// When a row is read, as a share of the readout: -1/2 the first, 1/2 the last.
double RowMoment(double row, int height);

/// Where the camera of the middle row would have seen what the row read at `moment` shows at `px`,
/// both in undistorted pixels. `inverse_depth`: of the point, 0 far away.
Eigen::Vector2d ToMiddleRow(const Pinhole& pinhole, const Eigen::Vector2d& px, double moment,
                            const ReadoutMotion& motion, double inverse_depth = 0);

/// The inverse of ToMiddleRow; `inverse_depth` is the one seen from the middle row.
Eigen::Vector2d FromMiddleRow(const Pinhole& pinhole, const Eigen::Vector2d& px, double moment,
                              const ReadoutMotion& motion, double inverse_depth = 0);

/// Where the image as taken shows what the camera of the middle row would see at `px`; nothing
/// outside the lens's range.
std::optional<Eigen::Vector2d> DistortInRow(const Camera& camera, const Eigen::Vector2d& px,
                                            const ReadoutMotion& motion, double inverse_depth = 0);

/// Where the middle row would have seen what was corrected for another motion so far, at a depth
/// seen from the middle row; nothing outside the lens's range.
std::optional<Eigen::Vector2d> ForOtherMotion(const Camera& camera, const Eigen::Vector2d& px,
                                              const ReadoutMotion& known,
                                              const ReadoutMotion& motion,
                                              double inverse_depth = 0);

}  // namespace deepuav
