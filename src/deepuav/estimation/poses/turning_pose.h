#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/poses/motion_only.h"
#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/geometry/rolling_shutter.h"

namespace deepuav {

/// A landmark, the pixel where a frame sees it, and when: RowMoment of the row that read it.
struct RowObservation {
  PoseObservation seen;
  double moment = 0;
};

struct TurningPoseOptions {
  int iterations = 15;            ///< Gauss-Newton steps.
  int min_observations = 40;      ///< Of a frame, below which its turn is not asked.
  double soft_sigmas = 2;         ///< Error from which an observation counts less (Cauchy's loss).
  double turn_sigma_rad = 0.03;   ///< How much a camera may turn while it reads an image...
  double bend_sigma_rad = 0.015;  ///< ...and how much of that may change meanwhile.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("iterations", iterations, "", "Gauss-Newton steps for the turn of one image",
          Between(1, 100));
    visit("min_observations", min_observations, "",
          "landmarks seen, below which an image is not asked how its camera turned",
          Between(7, 100'000));
    visit("soft_sigmas", soft_sigmas, "",
          "error in standard deviations from which an observation counts less", Above(0, 1e6));
    visit("turn_sigma_rad", turn_sigma_rad, "rad",
          "how much a camera may turn while it reads an image (standard deviation)", Above(0, 10));
    visit("bend_sigma_rad", bend_sigma_rad, "rad",
          "how much of that may change meanwhile (standard deviation)", Above(0, 10));
  }
};

/// d pixel that a row sees / d turn_rad, from PoseJacobian of the middle row: times the moment once
/// more it is that of bend_rad. The row's axes turn, so that what it sees moves the other way.
inline Matrix23d TurnJacobian(const Matrix26d& pose_jacobian, double moment) {
  return -moment * pose_jacobian.rightCols<3>();
}

/// What a camera with a rolling shutter may do while it reads an image.
enum class TurnModel { kNone, kTurn, kTurnAndBend };

struct TurningPose {
  SE3 cam_from_world;  ///< Of the middle row.
  /// Beyond what the pixels were corrected for: ReadoutMotion::turn_rad and bend_rad.
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero(), bend_rad = Eigen::Vector3d::Zero();
  int used = 0;               ///< Observations.
  double turn_sigma_rad = 0;  ///< Of an axis of the turn, by the noise that the pixels show.
  double cost = 0;            ///< Robust, of the observations.
};

/// The pose, and how the camera turned while it was read, that a frame's pixels tell against fixed
/// landmarks: the rotation of an image's rows against its middle one, as linear as it is small
/// (Albl et al. 2015, R6P, equation 6). Nothing where too few observations can be used.
std::optional<TurningPose> OptimiseTurningPose(const Pinhole& pinhole,
                                               std::span<const RowObservation> observations,
                                               const SE3& initial_cam_from_world, TurnModel model,
                                               const TurningPoseOptions& options);

}  // namespace deepuav
