#include "deepuav/inertial/chain/preintegration.h"

#include <algorithm>
#include <utility>

namespace deepuav {
namespace {

bool Earlier(const ImuSample& a, const ImuSample& b) { return a.time < b.time; }

}  // namespace

std::vector<ImuSample> CleanSamples(std::vector<ImuSample> samples) {
  std::erase_if(samples, [](const ImuSample& sample) {
    return !sample.angular_velocity.allFinite() || !sample.specific_force.allFinite();
  });
  std::stable_sort(samples.begin(), samples.end(), Earlier);
  const auto same_time = [](const ImuSample& a, const ImuSample& b) { return a.time == b.time; };
  samples.erase(std::unique(samples.begin(), samples.end(), same_time), samples.end());
  return samples;
}

ImuIntegrator::ImuIntegrator(std::vector<ImuSample> samples, const ImuNoise& noise,
                             double max_gap_s)
    : samples_(std::move(samples)), noise_(noise), max_gap_s_(max_gap_s) {}

std::optional<ImuSample> ImuIntegrator::At(Timestamp time) const {
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), ImuSample{time, {}, {}}, Earlier);
  if (after == samples_.end()) return std::nullopt;
  if (after->time == time) return *after;
  if (after == samples_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double gap_s = SecondsBetween(before->time, after->time);
  if (gap_s > max_gap_s_) return std::nullopt;
  const double ratio = SecondsBetween(before->time, time) / gap_s;
  return ImuSample{
      time, before->angular_velocity + ratio * (after->angular_velocity - before->angular_velocity),
      before->specific_force + ratio * (after->specific_force - before->specific_force)};
}

bool ImuIntegrator::Covers(Timestamp first, Timestamp last) const {
  if (last < first || !At(first) || !At(last)) return false;
  auto next = std::upper_bound(samples_.begin(), samples_.end(), ImuSample{first, {}, {}}, Earlier);
  for (; next != samples_.end() && next->time <= last; ++next) {
    if (next != samples_.begin() && SecondsBetween(std::prev(next)->time, next->time) > max_gap_s_)
      return false;
  }
  return true;
}

std::optional<Preintegration> ImuIntegrator::Between(Timestamp first, Timestamp last,
                                                     const ImuBias& bias) const {
  if (!(first < last) || !Covers(first, last)) return std::nullopt;
  Preintegration sum;
  ImuSample here = *At(first);
  auto next = std::upper_bound(samples_.begin(), samples_.end(), here, Earlier);
  for (; next != samples_.end() && next->time < last; ++next) {
    Step(here, *next, bias, &sum);
    here = *next;
  }
  Step(here, *At(last), bias, &sum);
  sum.duration_s = SecondsBetween(first, last);
  return sum;
}

/// By the trapezoidal rule. The noise of a sample enters as its bias does.
void ImuIntegrator::Step(const ImuSample& from, const ImuSample& to, const ImuBias& bias,
                         Preintegration* sum) const {
  const double step_s = SecondsBetween(from.time, to.time);
  const Eigen::Vector3d turn =
      step_s * (0.5 * (from.angular_velocity + to.angular_velocity) - bias.gyroscope_rad_s);
  const Eigen::Vector3d force_from = from.specific_force - bias.accelerometer_m_s2;
  const Eigen::Vector3d force_to = to.specific_force - bias.accelerometer_m_s2;
  const Eigen::Quaterniond step_rotation = RotationExp(turn);
  const Eigen::Quaterniond rotation_to = (sum->rotation * step_rotation).normalized();
  const Eigen::Matrix3d at_from = sum->rotation.toRotationMatrix();
  const Eigen::Matrix3d at_to = rotation_to.toRotationMatrix();
  const Eigen::Vector3d acceleration = 0.5 * (at_from * force_from + at_to * force_to);

  const Eigen::Matrix3d turned_by_turned = step_rotation.toRotationMatrix().transpose();
  const Eigen::Matrix3d turned_by_gyroscope = -step_s * RotationLeftJacobian(-turn);
  const Eigen::Matrix3d swing_to = -0.5 * at_to * Skew(force_to);
  const Eigen::Matrix3d by_turned = -0.5 * at_from * Skew(force_from) + swing_to * turned_by_turned;
  const Eigen::Matrix3d by_gyroscope = swing_to * turned_by_gyroscope;
  const Eigen::Matrix3d by_accelerometer = -0.5 * (at_from + at_to);
  const double half_square = 0.5 * step_s * step_s;

  Matrix9d by_before = Matrix9d::Identity();
  by_before.block<3, 3>(kTurned, kTurned) = turned_by_turned;
  by_before.block<3, 3>(kSpeeded, kTurned) = step_s * by_turned;
  by_before.block<3, 3>(kMoved, kTurned) = half_square * by_turned;
  by_before.block<3, 3>(kMoved, kSpeeded) = step_s * Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 9, 6> by_bias;
  by_bias << turned_by_gyroscope, Eigen::Matrix3d::Zero(), step_s * by_gyroscope,
      step_s * by_accelerometer, half_square * by_gyroscope, half_square * by_accelerometer;

  Vector6d variance;
  variance << Eigen::Vector3d::Constant(noise_.gyroscope_noise_density),
      Eigen::Vector3d::Constant(noise_.accelerometer_noise_density);
  variance = variance.cwiseAbs2() / step_s;
  sum->covariance = by_before * sum->covariance * by_before.transpose() +
                    by_bias * variance.asDiagonal() * by_bias.transpose();
  sum->by_bias = by_before * sum->by_bias + by_bias;
  sum->position_m += step_s * sum->velocity_m_s + half_square * acceleration;
  sum->velocity_m_s += step_s * acceleration;
  sum->rotation = rotation_to;
}

}  // namespace deepuav
