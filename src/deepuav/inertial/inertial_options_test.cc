#include "deepuav/inertial/inertial_options.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

TEST(NoiseOf, WhatASensorStatesGrowsAndWhatItDoesNotIsAsTheOptionsSay) {
  InertialOptions options;
  options.stated_noise_factor = 5;
  options.gyroscope_random_walk = 0.2;
  options.accelerometer_noise_density = 0.3;
  ImuStream imu;
  imu.noise.gyroscope_noise_density = 0.01;
  imu.noise.accelerometer_random_walk = 0.04;
  const ImuNoise noise = NoiseOf(imu, options);
  EXPECT_DOUBLE_EQ(noise.gyroscope_noise_density, 0.05);
  EXPECT_DOUBLE_EQ(noise.gyroscope_random_walk, 0.2);
  EXPECT_DOUBLE_EQ(noise.accelerometer_noise_density, 0.3);
  EXPECT_DOUBLE_EQ(noise.accelerometer_random_walk, 0.2);
}

}  // namespace
}  // namespace deepuav
