#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "deepuav/sensors/samples.h"

namespace deepuav {

/// The fixes in the GPMF track of a GoPro's MP4 (GPS5 and GPS9 of its cameras, GPRI of its Karma
/// drone), on the video's clock: those of a payload are spread evenly over its time. Payloads that
/// say that there is no fix, and latitude and longitude 0, are left out; of several receivers the
/// one with most fixes is taken. Empty for a file that is no MP4 or has no such track. What is
/// damaged is left out. Throws Error where the file cannot be read.
std::vector<GnssFix> ReadGpmfFixes(const std::filesystem::path& file);

/// The inertial samples of a GoPro camera in that track (GYRO and ACCL), on the video's clock and
/// in the sensor's own axes: at the gyroscope's times, the accelerometer in between. Empty and
/// Error as above.
std::vector<ImuSample> ReadGpmfImu(const std::filesystem::path& file);

/// The fixes of one payload of the track, which lasts from `start` for `duration_s`.
std::vector<GnssFix> ParseGpmfFixes(std::string_view payload, Timestamp start, double duration_s);

}  // namespace deepuav
