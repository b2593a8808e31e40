#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/random.h"
#include "deepuav/sensors/samples.h"
#include "deepuav/simulation/flight/flight_path.h"

namespace deepuav {

/// An inertial sensor; defaults: the noise of EuRoC's (ADIS16448, Burri et al. 2016).
struct ImuOptions {
  double rate_hz = 200;
  double gyroscope_noise_density = 1.6968e-4;
  double gyroscope_random_walk = 1.9393e-5;
  double accelerometer_noise_density = 2e-3;
  double accelerometer_random_walk = 3e-3;
  double gyroscope_start_bias_rad_s = 0.01;
  double accelerometer_start_bias_m_s2 = 0.05;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rate_hz", rate_hz, "Hz", "samples a second", Between(0.001, 1000));
    visit("gyroscope_noise_density", gyroscope_noise_density, "rad/s/sqrt(Hz)", "white noise",
          Between(0, 100));
    visit("gyroscope_random_walk", gyroscope_random_walk, "rad/s^2/sqrt(Hz)",
          "diffusion of the bias", Between(0, 100));
    visit("accelerometer_noise_density", accelerometer_noise_density, "m/s^2/sqrt(Hz)",
          "white noise", Between(0, 100));
    visit("accelerometer_random_walk", accelerometer_random_walk, "m/s^3/sqrt(Hz)",
          "diffusion of the bias", Between(0, 100));
    visit("gyroscope_start_bias_rad_s", gyroscope_start_bias_rad_s, "rad/s",
          "standard deviation of the bias at the start, an axis", Between(0, 100));
    visit("accelerometer_start_bias_m_s2", accelerometer_start_bias_m_s2, "m/s^2",
          "standard deviation of the bias at the start, an axis", Between(0, 100));
  }
};

/// A sample and what it would be without white noise and bias.
struct SimulatedImuSample {
  ImuSample measured;
  BodyState truth;
  Eigen::Vector3d gyroscope_bias, accelerometer_bias;
};

/// The samples of an inertial sensor in the body's origin, from time 0 to `duration_s`. `start`:
/// the time stamp of time 0. The biases walk as Brownian motions.
std::vector<SimulatedImuSample> SimulateImu(const FlightPath& path, const ImuOptions& options,
                                            double duration_s, Timestamp start, Random* random);

}  // namespace deepuav
