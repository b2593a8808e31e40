#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/rolling_shutter.h"
#include "deepuav/inertial/chain/preintegration.h"

namespace deepuav {

/// Whether its gyroscope tells how a camera turns.
inline bool HearsTurns(const ImuStream& imu) { return !imu.samples.empty() && imu.mount_is_known; }

/// How a gyroscope says that a camera turned: while it read an image, and from one image to
/// another. Immutable: may be asked from any thread. Its bias is in what it says; its clock is
/// taken to be the camera's.
class CameraTurns {
 public:
  /// `max_gap_s`: between samples that are interpolated.
  CameraTurns(const ImuStream& imu, double max_gap_s, const Camera& camera);

  const Camera& camera() const { return camera_; }

  /// The turn while the image was read whose middle row is of `time`; nothing where the camera
  /// reads all rows at once, or where the samples do not cover about half of it: beyond them the
  /// turn bends on as it did. What a gyroscope errs by is small beside a detector's noise then.
  std::optional<ReadoutMotion> DuringReadout(Timestamp time) const;

  /// now_from_before of the camera's axes; nothing where samples are missing or `now` does not come
  /// after `before`.
  std::optional<Eigen::Quaterniond> Between(Timestamp before, Timestamp now) const;

 private:
  /// Rotation vector in the camera's axes at `from`.
  std::optional<Eigen::Vector3d> TurnBetween(Timestamp from, Timestamp to) const;

  const Camera camera_;
  const Eigen::Quaterniond cam_from_imu_;
  const ImuIntegrator integrator_;
};

}  // namespace deepuav
