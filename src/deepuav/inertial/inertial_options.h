#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/sensors/standard_gravity.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

/// When an inertial sensor tells a path its scale and what is level, and what both are trusted
/// with.
struct InertialOptions {
  double gravity_m_s2 = kStandardGravity_m_s2;  ///< Where the flight is.
  double stated_noise_factor = 3;         ///< A sensor states its noise at rest; rotors shake it.
  double gyroscope_noise_density = 1e-3;  ///< rad/s/sqrt(Hz), where it is not stated.
  double gyroscope_random_walk = 1e-4;    ///< rad/s^2/sqrt(Hz), the same.
  double accelerometer_noise_density = 1e-2;   ///< m/s^2/sqrt(Hz), the same.
  double accelerometer_random_walk = 5e-3;     ///< m/s^3/sqrt(Hz), the same.
  double gyroscope_bias_sigma_rad_s = 0.05;    ///< Of an axis, at the start.
  double accelerometer_bias_sigma_m_s2 = 0.1;  ///< The same.
  double clock_sigma_s = 0.02;                 ///< Between the clocks of sensor and camera.
  double max_clock_offset_s = 0.1;             ///< Up to which it is searched.
  double scale_walk_sqrt_s = 5e-4;       ///< Random walk of the path's scale, as a share of it.
  double turn_walk_deg_sqrt_s = 0.005;   ///< Random walk of the path's turns.
  double level_walk_deg_sqrt_s = 0.002;  ///< Random walk of the vertical in the path.
  double path_scale_sigma = 0.003;  ///< Error of the whole path's scale that its poses do not show.
  double sensor_scale_sigma = 0.005;       ///< The same that a calibrated accelerometer brings...
  double uncalibrated_scale_sigma = 0.01;  ///< ...and one whose mount is not stated.
  double max_imu_gap_s = 0.05;             ///< Between samples that are interpolated.
  double max_path_gap_s = 1;               ///< Between poses whose motion is integrated.
  double min_pose_interval_s = 0.045;      ///< Poses that come more often are left out.
  double min_duration_s = 5;               ///< Of path with samples.
  double max_scale_sigma = 0.02;           ///< As a share of the scale.
  double max_tilt_sigma_deg = 1;
  double aligned_mount_sigma_deg = 0.5;  ///< Of an unknown mount along the camera's axes...
  double max_mount_doubt_deg = 12;       ///< ...taken where turns tell it no worse than this.
  double max_turn_residual_deg = 0.5;    ///< Between camera and gyroscope, an axis.
  double max_chi_square = 3;             ///< Of the integrated motions, a degree of freedom.
  double max_gyroscope_bias_rad_s = 0.2;
  double max_accelerometer_bias_m_s2 = 0.35;
  double running_window_s = 20;  ///< Latest part of a path by which it is told while it grows...
  double running_pose_interval_s = 0.2;  ///< ...from poses that are so far apart...
  double running_wait_s = 2;  ///< ...tried so often until something is found, then more seldom.
  double max_blind_s = 5;     ///< Without a pose, over which the samples alone carry the motion...
  double max_blind_misfit_m_s =
      0.5;  ///< ...if what they come to misses the poses after it by no more a second...
  double max_blind_turn_deg = 3;       ///< ...and so much.
  double blind_window_s = 3;           ///< Of path after it by which its scale is told.
  double max_blind_scale_sigma = 0.1;  ///< As a share of that scale.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("gravity_m_s2", gravity_m_s2, "m/s^2", "gravity where the flight is", Above(0, 100));
    visit("stated_noise_factor", stated_noise_factor, "",
          "by which the noise is multiplied that a sensor states, which is that at rest",
          Above(0, 1000));
    visit("gyroscope_noise_density", gyroscope_noise_density, "rad/s/sqrt(Hz)",
          "white noise where the sensor's is not stated", Above(0, 100));
    visit("gyroscope_random_walk", gyroscope_random_walk, "rad/s^2/sqrt(Hz)",
          "the same, of its bias", Above(0, 100));
    visit("accelerometer_noise_density", accelerometer_noise_density, "m/s^2/sqrt(Hz)",
          "the same, white noise", Above(0, 100));
    visit("accelerometer_random_walk", accelerometer_random_walk, "m/s^3/sqrt(Hz)",
          "the same, of its bias", Above(0, 100));
    visit("gyroscope_bias_sigma_rad_s", gyroscope_bias_sigma_rad_s, "rad/s",
          "standard deviation of the bias at the start, an axis", Above(0, 100));
    visit("accelerometer_bias_sigma_m_s2", accelerometer_bias_sigma_m_s2, "m/s^2",
          "standard deviation of the bias at the start, an axis", Above(0, 100));
    visit("clock_sigma_s", clock_sigma_s, "s",
          "standard deviation of the offset between the clocks of sensor and camera", Above(0, 10));
    visit("max_clock_offset_s", max_clock_offset_s, "s", "up to which it is searched",
          Between(0, 10));
    visit("scale_walk_sqrt_s", scale_walk_sqrt_s, "1/sqrt(s)",
          "random walk of the scale along the camera's path, as a share", Above(0, 1));
    visit("turn_walk_deg_sqrt_s", turn_walk_deg_sqrt_s, "deg/sqrt(s)",
          "random walk of its orientation, beside the gyroscope's noise", Between(0, 90));
    visit("level_walk_deg_sqrt_s", level_walk_deg_sqrt_s, "deg/sqrt(s)",
          "random walk of what is level in it", Above(0, 90));
    visit("path_scale_sigma", path_scale_sigma, "",
          "error of the scale of a whole path that its poses do not show, as a share",
          Between(0, 1));
    visit("sensor_scale_sigma", sensor_scale_sigma, "",
          "error of the scale that a sensor brings which was calibrated, as a share",
          Between(0, 1));
    visit("uncalibrated_scale_sigma", uncalibrated_scale_sigma, "",
          "error of the scale that a sensor's own, not calibrated, brings where not even its mount "
          "is stated, as a share",
          Between(0, 1));
    visit("max_imu_gap_s", max_imu_gap_s, "s", "longest gap of samples that is interpolated",
          Above(0, 100));
    visit("max_path_gap_s", max_path_gap_s, "s", "longest gap of poses that is integrated over",
          Above(0, 1000));
    visit("min_pose_interval_s", min_pose_interval_s, "s",
          "poses that come more often are left out", Between(0, 100));
    visit("min_duration_s", min_duration_s, "s", "path with samples without which nothing is told",
          Above(0, 1e6));
    visit("max_scale_sigma", max_scale_sigma, "",
          "standard deviation of the scale, as a share, above which nothing is told", Above(0, 1));
    visit("max_tilt_sigma_deg", max_tilt_sigma_deg, "deg", "the same of what is level",
          Above(0, 180));
    visit("aligned_mount_sigma_deg", aligned_mount_sigma_deg, "deg",
          "standard deviation of a mount along the camera's axes that is not stated", Above(0, 45));
    visit("max_mount_doubt_deg", max_mount_doubt_deg, "deg",
          "standard deviation of an unstated mount by turns alone up to which it is taken to be "
          "along the camera's axes where it is near them",
          Between(0, 20));
    visit("max_turn_residual_deg", max_turn_residual_deg, "deg",
          "between the turns of camera and gyroscope, above which the samples do not fit",
          Above(0, 180));
    visit("max_chi_square", max_chi_square, "",
          "of the integrated motions, a degree of freedom, above which they do not fit",
          Above(0, 1e6));
    visit("max_gyroscope_bias_rad_s", max_gyroscope_bias_rad_s, "rad/s",
          "bias above which the sensor is not trusted", Above(0, 100));
    visit("max_accelerometer_bias_m_s2", max_accelerometer_bias_m_s2, "m/s^2",
          "bias above which the sensor is not trusted", Above(0, 100));
    visit("running_window_s", running_window_s, "s",
          "latest part of a path by which scale and level are told while it grows", Above(0, 600));
    visit("running_pose_interval_s", running_pose_interval_s, "s",
          "between the poses that are used for this, at least", Between(0, 10));
    visit("running_wait_s", running_wait_s, "s",
          "between two tries; once something was found they become fewer", Above(0, 600));
    visit("max_blind_s", max_blind_s, "s",
          "time without a pose over which the samples alone carry the motion, at most",
          Between(0, 60));
    visit("max_blind_misfit_m_s", max_blind_misfit_m_s, "m/s",
          "by which this may miss the poses after it, a second", Above(0, 1000));
    visit("max_blind_turn_deg", max_blind_turn_deg, "deg", "the same of the orientation, in all",
          Above(0, 180));
    visit("blind_window_s", blind_window_s, "s",
          "path after it whose scale the samples tell where it has none of its own", Above(0, 60));
    visit("max_blind_scale_sigma", max_blind_scale_sigma, "",
          "standard deviation of that scale, as a share, above which it is not told", Above(0, 10));
  }
};

/// That of the options where none is stated.
ImuNoise NoiseOf(const ImuStream& imu, const InertialOptions& options);

}  // namespace deepuav
