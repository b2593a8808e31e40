#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/random.h"

namespace deepuav {

/// How wind and rotors shake the body about its course.
struct WindOptions {
  double jitter_position_m = 0.006;
  double jitter_angle_deg = 0.3;
  double jitter_low_hz = 1;
  double jitter_high_hz = 6;
  double gust_position_m = 0.1;
  double gust_low_hz = 0.1;
  double gust_high_hz = 0.4;

  void Check() const;
  /// Throws OptionError where two options contradict each other.
  void CheckRelations() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("jitter_position_m", jitter_position_m, "m",
          "standard deviation of fast shaking, an axis", Between(0, 10));
    visit("jitter_angle_deg", jitter_angle_deg, "deg", "the same of the attitude, an axis",
          Between(0, 90));
    visit("jitter_low_hz", jitter_low_hz, "Hz", "slowest part of the fast shaking",
          Between(0.001, 1000));
    visit("jitter_high_hz", jitter_high_hz, "Hz", "fastest part of it", Between(0.001, 1000));
    visit("gust_position_m", gust_position_m, "m", "standard deviation of slow drifting, an axis",
          Between(0, 100));
    visit("gust_low_hz", gust_low_hz, "Hz", "slowest part of the slow drifting",
          Between(0.001, 1000));
    visit("gust_high_hz", gust_high_hz, "Hz", "fastest part of it", Between(0.001, 1000));
  }
};

/// A vector that swings about zero, with its derivatives by time.
struct Swing {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

/// Noise of a given band and standard deviation as a sum of sinusoids of random frequency and phase
/// (Shinozuka and Deodatis 1991), infinitely differentiable. Amplitudes fall as
/// frequency ^ -`falloff`.
class BandNoise {
 public:
  BandNoise(double sigma, double low_hz, double high_hz, int falloff, Random* random);
  Swing At(double time_s) const;

 private:
  struct Sinusoid {
    int axis;
    double amplitude, angular_frequency, phase;
  };
  std::vector<Sinusoid> sinusoids_;
};

/// The shaking of one flight. The rotation vector turns the body about its own axes.
class WindJitter {
 public:
  WindJitter(const WindOptions& options, Random* random);
  Swing Position(double time_s) const;
  Swing Rotation(double time_s) const;

 private:
  BandNoise gust_, jitter_, rotation_;
};

}  // namespace deepuav
