#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/geometry/se3.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// What an inertial sensor shows when nothing moves; to be subtracted.
struct ImuBias {
  Eigen::Vector3d gyroscope_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_m_s2 = Eigen::Vector3d::Zero();
};

/// The order of rows in what follows.
enum PreintegratedPart { kTurned = 0, kSpeeded = 3, kMoved = 6 };

/// The motion between two moments that the samples alone tell, in the axes of the sensor at the
/// first one and without gravity (Forster et al. 2017, "On-manifold preintegration", section VI).
struct Preintegration {
  double duration_s = 0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< first_from_last.
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();        ///< Gained.
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();          ///< Gained, started at rest.
  /// Of a small turn of `rotation` from the right, velocity and position, by white noise.
  Matrix9d covariance = Matrix9d::Zero();
  /// Of the same by the biases, gyroscope's first.
  Eigen::Matrix<double, 9, 6> by_bias = Eigen::Matrix<double, 9, 6>::Zero();
};

/// The samples by growing time, of several at one time the first, and none that is not finite.
std::vector<ImuSample> CleanSamples(std::vector<ImuSample> samples);

/// Of samples by growing time. What lies between two samples is interpolated, unless they are more
/// than `max_gap_s` apart.
class ImuIntegrator {
 public:
  ImuIntegrator(std::vector<ImuSample> samples, const ImuNoise& noise, double max_gap_s);

  /// Nothing where samples are missing or `last` does not come after `first`.
  std::optional<Preintegration> Between(Timestamp first, Timestamp last, const ImuBias& bias) const;
  /// Whether there are samples from `first` to `last`, without a gap.
  bool Covers(Timestamp first, Timestamp last) const;
  std::optional<ImuSample> At(Timestamp time) const;
  const std::vector<ImuSample>& samples() const { return samples_; }
  const ImuNoise& noise() const { return noise_; }

 private:
  void Step(const ImuSample& from, const ImuSample& to, const ImuBias& bias,
            Preintegration* sum) const;

  const std::vector<ImuSample> samples_;
  const ImuNoise noise_;
  const double max_gap_s_;
};

}  // namespace deepuav
