#pragma once

#include <Eigen/Core>
#include <string>

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// How a camera is fixed to a body of x forward, y right, z down: body_from_cam, without offset.
/// `text`: `forward` (looks along x), `down` (looks along z, the image's upper edge in front), or
/// ROLL,PITCH,YAW in degrees, by which the camera is turned from `forward` (0,-30,0: 30 degrees
/// down). Throws Error for another text.
Eigen::Quaterniond ParseMount(const std::string& text);

/// Where camera or antenna is: X,Y,Z in metres: forward, right, down. Throws Error for what is no
/// such place on a vehicle.
Eigen::Vector3d ParseMountOffset(const std::string& text);

/// Of a body of x forward, y left, z up, as ROS and the simulator have it.
SE3 MountOfRosBody(const SE3& body_from_cam);

}  // namespace deepuav
