#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/sensors/streams.h"

namespace deepuav {

/// The imu0, gps0 and baro0 of a dataset in the EuRoC/ASL layout, each where it is there, in the
/// axes of the camera if `body_from_cam` is known, else of the body. Throws Error naming file, line
/// and field.
SensorStreams ReadEurocSensors(const std::filesystem::path& mav0,
                               const std::optional<SE3>& body_from_cam);

/// What an inertial sensor's sensor.yaml of EuRoC says of its noise; nothing of a file that is not
/// there. Throws Error naming file and field.
ImuNoise ReadImuNoise(const std::filesystem::path& file);

/// The samples of an imu0/data.csv ("ns, angular velocity, specific force").
std::vector<ImuSample> ReadImuFile(const std::filesystem::path& file);

/// The samples of a baro0/data.csv ("ns, pressure, altitude").
std::vector<BarometerSample> ReadBarometerFile(const std::filesystem::path& file);

/// The first file of fixes that is there among NAME.csv, NAME.gpx and their upper-case endings in
/// one of the folders; empty where there is none.
std::filesystem::path FindGnssBeside(const std::vector<std::filesystem::path>& folders,
                                     const std::string& name);
/// The fixes of that file; none where there is none. Their clock is the receiver's own. Throws
/// Error as ReadGnssFile.
GnssStream ReadGnssBeside(const std::vector<std::filesystem::path>& folders,
                          const std::string& name);

/// The fixes of a file beside a video, on its clock: subtitles (STEM.SRT), else STEM.csv or
/// STEM.gpx, whose first fix is taken to be at the video's start; else of the video's GPMF track.
/// Throws Error naming the file.
SensorStreams ReadSensorsBesideVideo(const std::filesystem::path& video);

}  // namespace deepuav
