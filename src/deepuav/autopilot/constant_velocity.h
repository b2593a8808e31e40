#pragma once

#include "deepuav/autopilot/motion_predictor.h"
#include "deepuav/autopilot/pose_noise.h"

namespace deepuav {

struct ConstantVelocityOptions {
  double acceleration_density = 1.5;  ///< m/s^2/sqrt(Hz): how the velocity wanders.
  double turn_density = 3;            ///< rad/s^2/sqrt(Hz): how the turn rate does.
  double velocity_sigma_m_s = 5;      ///< Before anything is known of it.
  double turn_rate_sigma_rad_s = 2;
  PoseTrust trust;
  double max_chi_square = 150;  ///< Of a pose from where it is expected, by six degrees of freedom.
};

/// Constant velocity and turn rate but for white noise: a Kalman filter.
class ConstantVelocity : public MotionPredictor {
 public:
  explicit ConstantVelocity(const ConstantVelocityOptions& options = {}) : options_(options) {}

  bool Expects(int64_t time_ns, const BodyPose& pose) const override;
  void Add(int64_t time_ns, const BodyPose& pose) override;
  void Jump(int64_t time_ns, const BodyPose& pose) override;
  void Forget() override { poses_ = 0; }
  std::optional<BodyMotion> At(int64_t time_ns) const override;

 private:
  BodyMotion Predicted(int64_t time_ns) const;
  void Begin(int64_t time_ns, const BodyPose& pose);

  const ConstantVelocityOptions options_;
  int poses_ = 0;
  int64_t time_ns_ = 0;
  BodyMotion motion_;
};

}  // namespace deepuav
