#include "support/synthetic_world.h"

#include <cmath>

namespace deepuav {

std::vector<SyntheticObservation> SyntheticWorld::Observe(const SE3& pose,
                                                          const SyntheticNoise& noise,
                                                          Random* random) const {
  std::vector<SyntheticObservation> observations;
  const auto inside = [&](const Eigen::Vector2d& px) {
    return px.x() >= -0.5 && px.y() >= -0.5 && px.x() < width - 0.5 && px.y() < height - 0.5;
  };
  for (size_t i = 0; i < landmarks_world.size(); ++i) {
    const Eigen::Vector3d point = pose * landmarks_world[i];
    if (point.z() <= 0) continue;
    const Eigen::Vector2d px = pinhole.Project(point);
    if (!inside(px)) continue;
    SyntheticObservation observation{static_cast<int>(i), px,
                                     random->Uniform(0, 1) < noise.outlier_ratio};
    if (observation.outlier) {
      observation.px.x() = random->Uniform(0, width);
      observation.px.y() = random->Uniform(0, height);
    } else if (noise.sigma_px > 0) {
      observation.px.x() += random->Gaussian(noise.sigma_px);
      observation.px.y() += random->Gaussian(noise.sigma_px);
    }
    observations.push_back(observation);
  }
  return observations;
}

std::vector<Eigen::Vector3d> LandmarksInBox(int count, const Eigen::Vector3d& low,
                                            const Eigen::Vector3d& high, Random* random) {
  std::vector<Eigen::Vector3d> landmarks(count);
  for (Eigen::Vector3d& landmark : landmarks) {
    for (int axis = 0; axis < 3; ++axis) landmark[axis] = random->Uniform(low[axis], high[axis]);
  }
  return landmarks;
}

std::vector<Eigen::Vector3d> LandmarksOnGround(int count, const Eigen::Vector2d& low,
                                               const Eigen::Vector2d& high, double relief_sigma,
                                               Random* random) {
  std::vector<Eigen::Vector3d> landmarks(count);
  for (Eigen::Vector3d& landmark : landmarks) {
    landmark.x() = random->Uniform(low.x(), high.x());
    landmark.y() = random->Uniform(low.y(), high.y());
    landmark.z() = relief_sigma > 0 ? random->Gaussian(relief_sigma) : 0;
  }
  return landmarks;
}

SE3 LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target,
           const Eigen::Vector3d& up) {
  Eigen::Matrix3d world_from_cam;
  world_from_cam.col(2) = (target - centre).normalized();
  world_from_cam.col(0) = world_from_cam.col(2).cross(up).normalized();
  world_from_cam.col(1) = world_from_cam.col(2).cross(world_from_cam.col(0));
  return SE3(world_from_cam, centre).Inverse();
}

SE3 LookDown(const Eigen::Vector3d& centre, double heading_rad) {
  const Eigen::Vector3d heading(std::cos(heading_rad), std::sin(heading_rad), 0);
  return LookAt(centre, centre - Eigen::Vector3d::UnitZ(), heading);
}

std::vector<SE3> StraightPath(int count, const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                              const Eigen::Vector3d& direction) {
  std::vector<SE3> path;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d centre =
        start + (end - start) * (count > 1 ? double(i) / (count - 1) : 0);
    path.push_back(LookAt(centre, centre + direction, Eigen::Vector3d::UnitZ()));
  }
  return path;
}

std::vector<SE3> OrbitPath(int count, const Eigen::Vector3d& centre, double radius, double height,
                           double angle_rad) {
  std::vector<SE3> path;
  for (int i = 0; i < count; ++i) {
    const double angle = angle_rad * i / count;
    const Eigen::Vector3d offset(radius * std::cos(angle), radius * std::sin(angle), height);
    path.push_back(LookAt(centre + offset, centre, Eigen::Vector3d::UnitZ()));
  }
  return path;
}

std::vector<SE3> SurveyPath(int rows, int columns, double spacing, double height) {
  std::vector<SE3> path;
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < columns; ++i) {
      const bool forth = row % 2 == 0;
      const int column = forth ? i : columns - 1 - i;
      path.push_back(LookDown({column * spacing, row * spacing, height}, forth ? 0 : M_PI));
    }
  }
  return path;
}

SE3 Perturbed(const SE3& pose, double translation, double rotation_rad, Random* random) {
  return SE3(RotationExp(rotation_rad * RandomDirection(random)),
             translation * RandomDirection(random)) *
         pose;
}

Eigen::Vector3d RandomDirection(Random* random) {
  return Eigen::Vector3d(random->Gaussian(1), random->Gaussian(1), random->Gaussian(1))
      .normalized();
}

}  // namespace deepuav
