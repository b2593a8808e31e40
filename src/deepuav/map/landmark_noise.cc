#include "deepuav/map/landmark_noise.h"

#include <Eigen/LU>

namespace deepuav {
namespace {

using Matrix23d = Eigen::Matrix<double, 2, 3>;

/// Of the least and the most certain direction, so that rays without parallax can be inverted.
constexpr double kLeastInformationRatio = 1e-9;

/// d (x/z, y/z) / d point_world.
Matrix23d Jacobian(const Eigen::Vector3d& point_cam, const Eigen::Matrix3d& cam_rotation_world) {
  constexpr Pinhole kUnit{1, 1, 0, 0};
  return kUnit.ProjectJacobian(point_cam) * cam_rotation_world;
}

}  // namespace

void PositionInformation::Add(const SE3& cam_from_world, const PixelNoise& noise) {
  const Eigen::Vector3d point_cam = cam_from_world * point_world_;
  if (!(point_cam.z() > 0)) return;
  const Matrix23d whitened =
      Whitening(noise) * Jacobian(point_cam, cam_from_world.RotationMatrix());
  information_ += whitened.transpose() * whitened;
}

Eigen::Matrix3d PositionInformation::Noise() const {
  const double least = kLeastInformationRatio * information_.trace();
  if (!(least > 0)) return Eigen::Matrix3d::Zero();
  return (information_ + least * Eigen::Matrix3d::Identity()).inverse();
}

Eigen::Matrix3d PositionNoise(const Map& map, const Landmark& landmark) {
  PositionInformation information(landmark.position_world);
  for (const Observation& observation : landmark.observations)
    information.Add(map.At(observation.keyframe).cam_from_world,
                    observation.measured.NoiseWith(map.model_sigma_px()));
  return information.Noise();
}

PixelNoise ExpectedPixelNoise(const Eigen::Matrix3d& position_noise,
                              const Eigen::Vector3d& landmark_world, const SE3& cam_from_world) {
  const Eigen::Vector3d landmark_cam = cam_from_world * landmark_world;
  if (!(landmark_cam.z() > 0)) return PixelNoise(0);
  const Matrix23d jacobian = Jacobian(landmark_cam, cam_from_world.RotationMatrix());
  return PixelNoise(Eigen::Matrix2d(jacobian * position_noise * jacobian.transpose()));
}

}  // namespace deepuav
