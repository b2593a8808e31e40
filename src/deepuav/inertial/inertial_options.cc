#include "deepuav/inertial/inertial_options.h"

#include <string>

#include "deepuav/base/option_check.h"

namespace deepuav {

void InertialOptions::Check() const { CheckOptions("sensors.imu", *this); }

ImuNoise NoiseOf(const ImuStream& imu, const InertialOptions& options) {
  const auto stated = [&options](double value, double otherwise) {
    return value > 0 ? options.stated_noise_factor * value : otherwise;
  };
  return {stated(imu.noise.gyroscope_noise_density, options.gyroscope_noise_density),
          stated(imu.noise.gyroscope_random_walk, options.gyroscope_random_walk),
          stated(imu.noise.accelerometer_noise_density, options.accelerometer_noise_density),
          stated(imu.noise.accelerometer_random_walk, options.accelerometer_random_walk)};
}

}  // namespace deepuav
