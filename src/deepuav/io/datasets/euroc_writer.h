#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/sensors/streams.h"

namespace deepuav {

// The files of a dataset in the EuRoC/ASL layout (Burri et al. 2016). Each is written atomically,
// its folder made where absent; `mav0` is the dataset's mav0/. All throw Error naming the file.

struct EurocImageName {
  Timestamp time;
  std::string file;  ///< In cam0/data.
};

/// cam0/data.csv and cam0/sensor.yaml, as OpenDataset reads them.
void WriteEurocCamera(const std::filesystem::path& mav0, const Camera& camera,
                      const SE3& body_from_cam, std::span<const EurocImageName> images);

/// imu0/data.csv and imu0/sensor.yaml of a sensor in the body's origin.
void WriteEurocImu(const std::filesystem::path& mav0, double rate_hz, const ImuNoise& noise,
                   std::span<const ImuSample> samples);

/// gps0/data.csv ("ns,latitude,longitude,altitude,sigma east,sigma north,sigma up") and
/// gps0/sensor.yaml, with the antenna's place in the body frame.
void WriteEurocGnss(const std::filesystem::path& mav0, double rate_hz,
                    const Eigen::Vector3d& antenna_in_body_m, std::span<const GnssFix> samples);

/// baro0/data.csv ("ns,pressure,altitude") and baro0/sensor.yaml of a sensor in the body's origin.
void WriteEurocBarometer(const std::filesystem::path& mav0, double rate_hz,
                         std::span<const BarometerSample> samples);

/// The truth of one instant.
struct TimedBodyState {
  Timestamp time;
  SE3 world_from_body;
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyroscope_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();
};

/// state_groundtruth_estimate0/data.csv, its sensor.yaml, and body.yaml.
void WriteEurocBodyTruth(const std::filesystem::path& mav0, std::span<const TimedBodyState> states);

/// groundtruth_cam0.csv ("ns, p, q_wxyz" of the camera in the world) in the dataset's folder.
void WriteCameraTruth(const std::filesystem::path& dataset, const Trajectory& trajectory);

}  // namespace deepuav
