#pragma once

#include "deepuav/geometry/se3.h"

namespace deepuav {

/// A similarity transform, named `a_from_b`: p_a = scale * rotation * p_b + translation.
class Sim3 {
 public:
  Sim3() = default;
  Sim3(double scale, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : scale_(scale), rigid_(rotation, translation) {}
  explicit Sim3(const SE3& rigid, double scale = 1) : scale_(scale), rigid_(rigid) {}

  double scale() const { return scale_; }
  const Eigen::Quaterniond& rotation() const { return rigid_.rotation(); }
  const Eigen::Vector3d& translation() const { return rigid_.translation(); }

  Sim3 Inverse() const;
  Sim3 operator*(const Sim3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale_ * (rotation() * point) + translation();
  }

  /// The pose of a camera after its world moved by this transform `new_from_old`: given cam_from_old, the rigid
  /// cam_from_new whose translation is in the new world's scale.
  SE3 MovePose(const SE3& cam_from_old) const;

 private:
  double scale_ = 1;
  SE3 rigid_;
};

}  // namespace deepuav
