#include "deepuav/geometry/sim3.h"

namespace deepuav {

Sim3 Sim3::Inverse() const {
  const Eigen::Quaterniond inverse = rotation().conjugate();
  return Sim3(1 / scale_, inverse, -(inverse * translation()) / scale_);
}

Sim3 Sim3::operator*(const Sim3& other) const {
  return Sim3(scale_ * other.scale_, rotation() * other.rotation(), *this * other.translation());
}

SE3 Sim3::MovePose(const SE3& cam_from_old) const {
  const Eigen::Quaterniond cam_from_new = cam_from_old.rotation() * rotation().conjugate();
  const Eigen::Vector3d center_new = *this * cam_from_old.InverseTranslation();
  return SE3(cam_from_new, -(cam_from_new * center_new));
}

}  // namespace deepuav
