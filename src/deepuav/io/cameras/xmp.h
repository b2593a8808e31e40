#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string_view>

#include "deepuav/sensors/samples.h"

namespace deepuav {

/// A position by a receiver with corrections (RTK): DJI's GpsLatitude, GpsLongitude and
/// AbsoluteAltitude where drone-dji:RtkFlag says that there were some, with RtkStdLon, Lat, Hgt.
/// Without a time. Nothing where there were none, or what is said cannot be: EXIF has the position,
/// too, in fewer digits.
std::optional<GnssFix> ParseXmpRtkFix(std::string_view head);

/// How exact the position in EXIF is, east, north and up: Camera:GPSXYAccuracy and GPSZAccuracy of
/// Pix4D's name space. 0: not stated.
Eigen::Vector3d ParseXmpAccuracy_m(std::string_view head);

/// enu_from_cam (east, north, up; the camera's x right, y down, z ahead) by DJI's GimbalYawDegree
/// from north over east, GimbalPitchDegree up and GimbalRollDegree clockwise. Nothing where one is
/// missing or all are 0, as cameras without a gimbal write them.
std::optional<Eigen::Quaterniond> ParseXmpAttitude(std::string_view head);

}  // namespace deepuav
