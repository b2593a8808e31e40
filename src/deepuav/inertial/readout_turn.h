#pragma once

#include <optional>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

/// How a gyroscope says that a camera turned while it read its images. Immutable: may be asked from
/// any thread.
class ReadoutTurns {
 public:
  /// What a gyroscope errs by is small beside a detector's noise within a readout.
  ReadoutTurns(const ImuStream& imu, const Camera& camera);

  const Camera& camera() const { return camera_; }

  /// The rotation vector from the first row to the last, in the camera's axes, of the image whose
  /// middle row is of `time`; nothing where the samples do not cover it.
  std::optional<Eigen::Vector3d> At(Timestamp time) const;

 private:
  /// Of the camera; by the samples' straight lines in between.
  std::optional<Eigen::Vector3d> AngleSinceStart(Timestamp time) const;

  const Camera camera_;
  std::vector<Timestamp> times_;
  std::vector<Eigen::Vector3d> rates_cam_, angles_cam_;  ///< rad/s; rad, added up since the start.
};

}  // namespace deepuav
