#include "deepuav/simulation/sensors/imu.h"

#include <cmath>

#include "deepuav/base/option_check.h"
#include "deepuav/simulation/flight/quadrotor_path.h"
#include "deepuav/simulation/sensors/sensor_clock.h"

namespace deepuav {
namespace {

Eigen::Vector3d GaussianVector(double sigma, Random* random) {
  const double x = random->Gaussian(sigma), y = random->Gaussian(sigma);
  return {x, y, random->Gaussian(sigma)};
}

}  // namespace

void ImuOptions::Check() const { CheckOptions("imu", *this); }

std::vector<SimulatedImuSample> SimulateImu(const FlightPath& path, const ImuOptions& options,
                                            double duration_s, Timestamp start, Random* random) {
  const double step_s = 1 / options.rate_hz;
  const double noise_scale = std::sqrt(options.rate_hz), walk_scale = std::sqrt(step_s);
  const Eigen::Vector3d gravity(0, 0, -kGravityMps2);
  Eigen::Vector3d gyroscope_bias = GaussianVector(options.gyroscope_start_bias_rad_s, random);
  Eigen::Vector3d accelerometer_bias =
      GaussianVector(options.accelerometer_start_bias_m_s2, random);
  const int count = SampleCount(duration_s, options.rate_hz);
  std::vector<SimulatedImuSample> samples;
  samples.reserve(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    SimulatedImuSample& sample = samples.emplace_back();
    sample.truth = path.At(i * step_s);
    sample.gyroscope_bias = gyroscope_bias;
    sample.accelerometer_bias = accelerometer_bias;
    sample.measured.time = After(start, i * step_s);
    sample.measured.angular_velocity =
        sample.truth.angular_velocity_body + gyroscope_bias +
        GaussianVector(options.gyroscope_noise_density * noise_scale, random);
    sample.measured.specific_force =
        sample.truth.world_from_body.rotation().conjugate() *
            (sample.truth.acceleration_world - gravity) +
        accelerometer_bias +
        GaussianVector(options.accelerometer_noise_density * noise_scale, random);
    gyroscope_bias += GaussianVector(options.gyroscope_random_walk * walk_scale, random);
    accelerometer_bias += GaussianVector(options.accelerometer_random_walk * walk_scale, random);
  }
  return samples;
}

}  // namespace deepuav
