#include "deepuav/autopilot/inertial_prediction.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "deepuav/autopilot/pose_noise.h"

namespace deepuav {
namespace {

double Seconds(int64_t from_ns, int64_t to_ns) {
  return SecondsBetween(Timestamp{from_ns}, Timestamp{to_ns});
}

double SquaredError(const SE3& foretold, const SE3& found, double turn_per_metre) {
  Vector6d residual = PoseResidual(foretold, found);
  residual.tail<3>() /= turn_per_metre;
  return residual.squaredNorm();
}

ImuSample Between(const ImuSample& before, const ImuSample& after, int64_t time_ns) {
  const double whole = Seconds(before.time.nanoseconds, after.time.nanoseconds);
  const double part = Seconds(before.time.nanoseconds, time_ns) / whole;
  return {Timestamp{time_ns}, (1 - part) * before.angular_velocity + part * after.angular_velocity,
          (1 - part) * before.specific_force + part * after.specific_force};
}

bool IsEarlier(int64_t time_ns, const ImuSample& sample) {
  return time_ns < sample.time.nanoseconds;
}

}  // namespace

void InertialPrediction::AddInertial(const ImuSample& sample) {
  if (!samples_.empty() && sample.time <= samples_.back().time) return;
  samples_.push_back(sample);
  while (SecondsBetween(samples_.front().time, sample.time) > options_.kept_s) samples_.pop_front();
}

bool InertialPrediction::uses_samples() const {
  return filter_ && judged_ >= options_.fewest_judged && inertial_error_ <= plain_error_;
}

bool InertialPrediction::HasSamples(int64_t from_ns, int64_t to_ns) const {
  auto next = std::upper_bound(samples_.begin(), samples_.end(), from_ns, IsEarlier);
  if (next == samples_.begin()) return false;
  for (; next != samples_.end(); ++next) {
    if (SecondsBetween((next - 1)->time, next->time) > options_.longest_gap_s) return false;
    if (next->time.nanoseconds >= to_ns) return true;
  }
  return Seconds(samples_.back().time.nanoseconds, to_ns) <= options_.longest_ahead_s;
}

std::optional<InertialFilter> InertialPrediction::FilterAt(int64_t time_ns) const {
  if (!filter_ || time_ns < filter_->time_ns || !HasSamples(filter_->time_ns, time_ns))
    return std::nullopt;
  InertialFilter filter = *filter_;
  auto next = std::upper_bound(samples_.begin(), samples_.end(), filter.time_ns, IsEarlier);
  for (; next != samples_.end() && filter.time_ns < time_ns; ++next) {
    const int64_t until_ns = std::min(next->time.nanoseconds, time_ns);
    const int64_t middle_ns = filter.time_ns + (until_ns - filter.time_ns) / 2;
    Integrate(Between(*(next - 1), *next, middle_ns), until_ns, options_.errors, &filter);
  }
  if (filter.time_ns < time_ns) GoOn(time_ns, &filter);
  return filter;
}

/// What the last sample shows wanders from then on as it does without samples.
void InertialPrediction::GoOn(int64_t time_ns, InertialFilter* filter) const {
  const double ahead_s = Seconds(filter->time_ns, time_ns);
  InertialErrors errors = options_.errors;
  errors.accelerometer_density = options_.plain.acceleration_density;
  Integrate(samples_.back(), time_ns, errors, filter);
  filter->covariance.diagonal().segment<3>(InertialFilter::kRotation).array() +=
      ahead_s * ahead_s / 3 * TurnVariance(ahead_s);
}

double InertialPrediction::TurnVariance(double ahead_s) const {
  return ahead_s * options_.plain.turn_density * options_.plain.turn_density;
}

void InertialPrediction::Begin(int64_t time_ns, const BodyPose& pose) {
  const std::optional<BodyMotion> motion = plain_.At(time_ns);
  const std::optional<InertialFilter> before = filter_;
  filter_.reset();
  if (!motion) return;
  InertialFilter filter;
  filter.time_ns = time_ns;
  filter.local_from_body = pose.local_from_body;
  filter.velocity_local = motion->velocity_local;
  filter.covariance.setZero();
  filter.covariance.topLeftCorner<9, 9>() = motion->covariance.topLeftCorner<9, 9>();
  filter.covariance.bottomRightCorner<6, 6>() = DiagonalOf(
      options_.errors.gyroscope_bias_sigma_rad_s, options_.errors.accelerometer_bias_sigma_m_s2);
  if (before) {
    filter.gyroscope_bias = before->gyroscope_bias;
    filter.accelerometer_bias = before->accelerometer_bias;
    filter.covariance.bottomRightCorner<6, 6>() = before->covariance.bottomRightCorner<6, 6>();
  }
  filter_ = filter;
}

void InertialPrediction::JudgeBy(const std::optional<InertialFilter>& foretold, int64_t time_ns,
                                 const BodyPose& pose) {
  const std::optional<BodyMotion> plainly = plain_.At(time_ns);
  if (!foretold || !plainly) return;
  judged_ = std::min(judged_ + 1, options_.judged_images);
  const auto take = [&](const SE3& predicted, double* mean) {
    *mean +=
        (SquaredError(predicted, pose.local_from_body, options_.turn_per_metre) - *mean) / judged_;
  };
  take(foretold->local_from_body, &inertial_error_);
  take(plainly->local_from_body, &plain_error_);
}

bool InertialPrediction::Expects(int64_t time_ns, const BodyPose& pose) const {
  const std::optional<InertialFilter> filter = uses_samples() ? FilterAt(time_ns) : std::nullopt;
  if (!filter) return plain_.Expects(time_ns, pose);
  const Vector6d residual = PoseResidual(filter->local_from_body, pose.local_from_body);
  const Matrix6d covariance =
      filter->covariance.topLeftCorner<6, 6>() + NoiseOf(pose, options_.plain.trust);
  return residual.dot(covariance.llt().solve(residual)) <= options_.plain.max_chi_square;
}

void InertialPrediction::Add(int64_t time_ns, const BodyPose& pose) {
  std::optional<InertialFilter> filter = FilterAt(time_ns);
  JudgeBy(filter, time_ns, pose);
  plain_.Add(time_ns, pose);
  covariance_is_known_ = pose.covariance_is_known;
  if (!filter) return Begin(time_ns, pose);
  Correct(pose.local_from_body, NoiseOf(pose, options_.plain.trust), &*filter);
  filter_ = filter;
}

void InertialPrediction::Jump(int64_t time_ns, const BodyPose& pose) {
  std::optional<InertialFilter> filter = FilterAt(time_ns);
  plain_.Jump(time_ns, pose);
  covariance_is_known_ = pose.covariance_is_known;
  if (!filter) return Begin(time_ns, pose);
  MoveFrame(pose.local_from_body, NoiseOf(pose, options_.plain.trust), &*filter);
  filter_ = filter;
}

void InertialPrediction::Forget() {
  plain_.Forget();
  filter_.reset();
  judged_ = inertial_error_ = plain_error_ = 0;
}

std::optional<BodyMotion> InertialPrediction::At(int64_t time_ns) const {
  const std::optional<InertialFilter> filter = uses_samples() ? FilterAt(time_ns) : std::nullopt;
  if (!filter) return plain_.At(time_ns);
  const auto next = std::upper_bound(samples_.begin(), samples_.end(), time_ns, IsEarlier);
  BodyMotion motion;
  motion.local_from_body = filter->local_from_body;
  motion.velocity_local = filter->velocity_local;
  motion.turn_rate_body = (next - 1)->angular_velocity - filter->gyroscope_bias;
  // A turn rate errs by the bias that was taken off.
  Eigen::Matrix<double, 12, 15> parts = Eigen::Matrix<double, 12, 15>::Zero();
  parts.topLeftCorner<9, 9>().setIdentity();
  parts.block<3, 3>(9, InertialFilter::kGyroscope) = -Eigen::Matrix3d::Identity();
  motion.covariance = parts * filter->covariance * parts.transpose();
  const double ahead_s = std::max(0.0, Seconds(samples_.back().time.nanoseconds, time_ns));
  motion.covariance.diagonal().tail<3>().array() +=
      options_.errors.turn_rate_sigma_rad_s * options_.errors.turn_rate_sigma_rad_s +
      TurnVariance(ahead_s);
  motion.covariance_is_known = covariance_is_known_;
  return motion;
}

}  // namespace deepuav
