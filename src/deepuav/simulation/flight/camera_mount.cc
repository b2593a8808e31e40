#include "deepuav/simulation/flight/camera_mount.h"

#include <numbers>

#include "deepuav/base/option_check.h"

namespace deepuav {

void CameraMountOptions::Check() const { CheckOptions("mount", *this); }

SE3 BodyFromCam(const CameraMountOptions& mount) {
  constexpr double kRadiansPerDegree = std::numbers::pi / 180;
  Eigen::Matrix3d ahead_from_cam;  // body axes: x forward, y left, z up
  ahead_from_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(mount.pan_deg * kRadiansPerDegree, Eigen::Vector3d::UnitZ()) *
       Eigen::AngleAxisd(-mount.pitch_deg * kRadiansPerDegree, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  return SE3(Eigen::Matrix3d(turn * ahead_from_cam), {mount.x_m, mount.y_m, mount.z_m});
}

}  // namespace deepuav
