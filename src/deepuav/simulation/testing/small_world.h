#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/core.hpp>

#include "deepuav/simulation/rendering/renderer.h"

namespace deepuav {

inline SceneOptions SmallScene() {
  SceneOptions scene;
  scene.extent_m = 300;
  scene.town_radius_m = 70;
  scene.lake_radius_m = 25;
  scene.cars_per_km = 60;
  return scene;
}

inline const World& SmallWorld() {
  static const World world(SmallScene());
  return world;
}

inline Camera TestCamera(LensModel lens) {
  Camera camera;
  camera.width = 376;
  camera.height = 240;
  camera.pinhole = {230, 229, 183.6, 124.2};
  camera.lens = lens;
  if (lens == LensModel::kRadialTangential) camera.distortion = {-0.283, 0.074, 0.0002, 0.00002};
  if (lens == LensModel::kEquidistant) {
    camera.pinhole = {190, 190, 187.1, 119.4};
    camera.distortion = {-0.01, 0.02, -0.01, 0.002};
  }
  return camera;
}

// A camera that looks down at the given angle, towards `yaw`.
inline Eigen::Matrix3d Looking(double yaw, double down) {
  const Eigen::Vector3d forward(std::cos(yaw) * std::cos(down), std::sin(yaw) * std::cos(down),
                                -std::sin(down));
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0);
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  return rotation;
}

// Flies and turns, as a drone in haste.
inline SE3 Flight(double time_s) {
  const Eigen::Vector3d position(-20 + 9 * time_s, 10 - 4 * time_s, 45 + 2 * time_s);
  return SE3(Looking(0.4 + 0.8 * time_s, 0.9 + 0.3 * time_s), position);
}

inline SE3 Still(double) { return Flight(0); }

// Light in, level out: no effect of the lens or sensor, and one exposure.
inline RenderOptions Linear() {
  RenderOptions options;
  options.sensor.vignetting = 0;
  options.sensor.defocus_px = 0;
  options.sensor.gamma = 1;
  options.sensor.full_well_electrons = 1e9;
  options.sensor.read_noise_electrons = 0;
  options.sensor.sunlit_exposure_s = options.sensor.min_exposure_s = options.sensor.max_exposure_s =
      0.004;
  options.sensor.max_gain = 1;
  return options;
}

/// Standard deviation of grey.
inline double Contrast(const GreyImage& image) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0];
}

}  // namespace deepuav
