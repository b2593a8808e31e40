#pragma once

#include <deque>

#include "deepuav/autopilot/constant_velocity.h"
#include "deepuav/autopilot/inertial_filter.h"

namespace deepuav {

struct InertialPredictionOptions {
  ConstantVelocityOptions plain;  ///< Without samples; its trust in poses is that with them, too.
  InertialErrors errors;
  double longest_gap_s = 0.05;   ///< Between samples...
  double longest_ahead_s = 0.1;  ///< ...and after the last one, which goes on.
  double kept_s = 2;             ///< Of samples.
  /// Of the images whose foretelling is remembered, by which it is judged.
  double judged_images = 20;
  double fewest_judged = 5;     ///< Before so many were foretold constant velocity speaks.
  double turn_per_metre = 0.3;  ///< Error of a turn that counts as much as a metre, rad.
};

/// By the samples of the body's inertial sensor where they are there and foretold the latest images
/// better than constant velocity did: a sensor that is turned, or not level, does not.
class InertialPrediction : public MotionPredictor {
 public:
  explicit InertialPrediction(const InertialPredictionOptions& options = {})
      : options_(options), plain_(options.plain) {}

  bool Expects(int64_t time_ns, const BodyPose& pose) const override;
  void Add(int64_t time_ns, const BodyPose& pose) override;
  void Jump(int64_t time_ns, const BodyPose& pose) override;
  void Forget() override;
  std::optional<BodyMotion> At(int64_t time_ns) const override;
  void AddInertial(const ImuSample& sample) override;

  /// Whether samples speak now.
  bool uses_samples() const;

 private:
  /// The filter at a later time; nothing where samples are missing.
  std::optional<InertialFilter> FilterAt(int64_t time_ns) const;
  void GoOn(int64_t time_ns, InertialFilter* filter) const;
  /// Of a turn rate that was measured so long ago, rad^2/s^2.
  double TurnVariance(double ahead_s) const;
  bool HasSamples(int64_t from_ns, int64_t to_ns) const;
  /// Begins at a pose with the velocity that the plain prediction has there, and keeps the biases.
  void Begin(int64_t time_ns, const BodyPose& pose);
  void JudgeBy(const std::optional<InertialFilter>& foretold, int64_t time_ns,
               const BodyPose& pose);

  const InertialPredictionOptions options_;
  ConstantVelocity plain_;
  std::deque<ImuSample> samples_;
  std::optional<InertialFilter> filter_;  ///< At the last pose.
  bool covariance_is_known_ = false;
  /// Mean squared errors of foretelling poses, and of how many images these are the mean.
  double inertial_error_ = 0, plain_error_ = 0, judged_ = 0;
};

}  // namespace deepuav
