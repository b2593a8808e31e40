#include "deepuav/inertial/inertial_options.h"

#include <string>

#include "deepuav/base/option_bounds.h"

namespace deepuav {

void InertialOptions::Check() const {
  const auto positive = [](const char* name, double value, double high) {
    CheckPositive(std::string("sensors.imu.") + name, value, high);
  };
  positive("gravity_m_s2", gravity_m_s2, 100);
  positive("stated_noise_factor", stated_noise_factor, 1000);
  positive("gyroscope_noise_density", gyroscope_noise_density, 100);
  positive("gyroscope_random_walk", gyroscope_random_walk, 100);
  positive("accelerometer_noise_density", accelerometer_noise_density, 100);
  positive("accelerometer_random_walk", accelerometer_random_walk, 100);
  positive("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s, 100);
  positive("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2, 100);
  positive("clock_sigma_s", clock_sigma_s, 10);
  CheckRange("sensors.imu.max_clock_offset_s", max_clock_offset_s, 0, 10);
  positive("scale_walk_sqrt_s", scale_walk_sqrt_s, 1);
  CheckRange("sensors.imu.turn_walk_deg_sqrt_s", turn_walk_deg_sqrt_s, 0, 90);
  positive("level_walk_deg_sqrt_s", level_walk_deg_sqrt_s, 90);
  CheckRange("sensors.imu.path_scale_sigma", path_scale_sigma, 0, 1);
  positive("max_imu_gap_s", max_imu_gap_s, 100);
  positive("max_path_gap_s", max_path_gap_s, 1000);
  CheckRange("sensors.imu.min_pose_interval_s", min_pose_interval_s, 0, 100);
  positive("min_duration_s", min_duration_s, 1e6);
  positive("max_scale_sigma", max_scale_sigma, 1);
  positive("max_tilt_sigma_deg", max_tilt_sigma_deg, 180);
  positive("max_turn_residual_deg", max_turn_residual_deg, 180);
  positive("max_chi_square", max_chi_square, 1e6);
  positive("max_gyroscope_bias_rad_s", max_gyroscope_bias_rad_s, 100);
  positive("max_accelerometer_bias_m_s2", max_accelerometer_bias_m_s2, 100);
  positive("running_window_s", running_window_s, 600);
  CheckRange("sensors.imu.running_pose_interval_s", running_pose_interval_s, 0, 10);
  positive("running_wait_s", running_wait_s, 600);
  CheckRange("sensors.imu.max_blind_s", max_blind_s, 0, 60);
  positive("max_blind_misfit_m_s", max_blind_misfit_m_s, 1000);
  positive("max_blind_turn_deg", max_blind_turn_deg, 180);
  positive("blind_window_s", blind_window_s, 60);
  positive("max_blind_scale_sigma", max_blind_scale_sigma, 10);
}

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
