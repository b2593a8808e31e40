#pragma once

#include <cstdint>
#include <optional>

#include "deepuav/autopilot/body_pose.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// How a body moves at one instant.
struct BodyMotion {
  SE3 local_from_body;
  Eigen::Vector3d velocity_local = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Vector3d turn_rate_body = Eigen::Vector3d::Zero();  ///< rad/s
  /// Of [position in the local axes; rotation vector in the body's; velocity; turn rate].
  Matrix12d covariance = Matrix12d::Identity();
  bool covariance_is_known = false;
};

/// Goes on between and after images. Times: nanoseconds of one clock, here and below.
class MotionPredictor {
 public:
  virtual ~MotionPredictor() = default;
  /// Whether the body may have come to this pose by moving.
  virtual bool Expects(int64_t time_ns, const BodyPose& pose) const = 0;
  /// An image's pose, of a later time than the one before.
  virtual void Add(int64_t time_ns, const BodyPose& pose) = 0;
  /// The same where the local frame moved since: what is known of the body's own motion stays.
  virtual void Jump(int64_t time_ns, const BodyPose& pose) = 0;
  /// Nothing is known any more.
  virtual void Forget() = 0;
  /// Nothing before the second pose.
  virtual std::optional<BodyMotion> At(int64_t time_ns) const = 0;
  /// What the body's inertial sensor measures, on the same clock; later than the one before.
  virtual void AddInertial(const ImuSample& /*sample*/) {}
};

}  // namespace deepuav
