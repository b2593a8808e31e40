#pragma once

#include <Eigen/Core>
#include <optional>

#include "deepuav/geometry/camera.h"
#include "deepuav/inertial/preintegration.h"

namespace deepuav {

/// How a gyroscope says that a camera turned while it read its images. Immutable: may be asked from
/// any thread. What a gyroscope errs by is small beside a detector's noise within a readout; its
/// clock is taken to be the camera's.
class ReadoutTurns {
 public:
  /// `max_gap_s`: between samples that are interpolated.
  ReadoutTurns(const ImuStream& imu, double max_gap_s, const Camera& camera);

  const Camera& camera() const { return camera_; }

  /// The rotation vector from the first row to the last, in the camera's axes, of the image whose
  /// middle row is of `time`; nothing where the samples do not cover about half of it.
  std::optional<Eigen::Vector3d> At(Timestamp time) const;

 private:
  const Camera camera_;
  const Eigen::Quaterniond cam_from_imu_;
  const ImuIntegrator integrator_;
};

}  // namespace deepuav
