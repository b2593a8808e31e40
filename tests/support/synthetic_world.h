#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/random.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// A pixel of a landmark in a camera; of an outlier, a pixel anywhere in the image.
struct SyntheticObservation {
  int landmark = 0;
  Eigen::Vector2d px;
  bool outlier = false;
};

struct SyntheticNoise {
  double sigma_px = 0;       ///< Per axis, normal.
  double outlier_ratio = 0;  ///< Share of the observations.
};

/// A camera moving through known landmarks.
struct SyntheticWorld {
  Pinhole pinhole{450, 450, 376, 240};
  int width = 752, height = 480;  ///< px
  std::vector<Eigen::Vector3d> landmarks_world;
  std::vector<SE3> cam_from_world;

  /// The landmarks in front of the camera and inside its image, in the order of the landmarks.
  std::vector<SyntheticObservation> Observe(const SE3& cam_from_world, const SyntheticNoise& noise,
                                            Random* random) const;
};

/// Uniform in the box.
std::vector<Eigen::Vector3d> LandmarksInBox(int count, const Eigen::Vector3d& low,
                                            const Eigen::Vector3d& high, Random* random);
/// Uniform over a rectangle of the ground (z = 0 at the world's origin, z up) with heights normal
/// about 0; relief 0 gives a plane.
std::vector<Eigen::Vector3d> LandmarksOnGround(int count, const Eigen::Vector2d& low,
                                               const Eigen::Vector2d& high, double relief_sigma,
                                               Random* random);

/// A camera at `centre` that looks at `target`; `up` points to the top of its image.
SE3 LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target, const Eigen::Vector3d& up);
/// A camera at `centre` that looks straight down (world z up); the top of its image points to
/// `heading_rad` from x.
SE3 LookDown(const Eigen::Vector3d& centre, double heading_rad);

/// `count` cameras from `start` to `end`, all looking along `direction`, world z up.
std::vector<SE3> StraightPath(int count, const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                              const Eigen::Vector3d& direction);
/// `count` cameras on a horizontal circle, evenly spaced over `angle_rad`, looking at its centre.
std::vector<SE3> OrbitPath(int count, const Eigen::Vector3d& centre, double radius, double height,
                           double angle_rad);
/// `rows` x `columns` cameras looking down from `height`, rows flown to and fro, `spacing` apart;
/// starts at the origin.
std::vector<SE3> SurveyPath(int rows, int columns, double spacing, double height);

/// `pose` moved by a rotation and a translation of exactly these sizes in random directions
/// (left-multiplied).
SE3 Perturbed(const SE3& pose, double translation, double rotation_rad, Random* random);

/// Uniform on the unit sphere.
Eigen::Vector3d RandomDirection(Random* random);

}  // namespace deepuav
