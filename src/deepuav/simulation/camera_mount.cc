#include "deepuav/simulation/camera_mount.h"

#include <numbers>

#include "deepuav/base/option_bounds.h"

namespace deepuav {

void CameraMountOptions::Check() const {
  CheckRange("mount.pitch_deg", pitch_deg, -90, 90);
  CheckRange("mount.pan_deg", pan_deg, -360, 360);
  constexpr double kLongestArmM = 100;
  CheckRange("mount.x_m", x_m, -kLongestArmM, kLongestArmM);
  CheckRange("mount.y_m", y_m, -kLongestArmM, kLongestArmM);
  CheckRange("mount.z_m", z_m, -kLongestArmM, kLongestArmM);
}

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
