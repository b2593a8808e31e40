#include "deepuav/estimation/poses/motion_only.h"

#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/estimation/solvers/damped_gauss_newton.h"

namespace deepuav {
namespace {

constexpr int kMinObservations = 3;

using Equations = NormalEquations<6>;

bool Usable(const PoseObservation& observation) {
  return observation.landmark_world.allFinite() && observation.px.allFinite() &&
         observation.noise.usable();
}

/// Reprojection error in pixels; infinite behind the camera.
Eigen::Vector2d ErrorPx(const Pinhole& pinhole, const PoseObservation& observation,
                        const SE3& pose) {
  const Eigen::Vector3d point = pose * observation.landmark_world;
  if (!InFrontOfCamera(point))
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  return pinhole.Project(point) - observation.px;
}

class PoseProblem {
 public:
  PoseProblem(const Pinhole& pinhole, const std::vector<PoseObservation>& observations,
              const MotionOnlyOptions& options)
      : pinhole_(pinhole), observations_(observations), chi_square_(options.chi_square) {
    active_.resize(observations.size());
    whitening_.reserve(observations.size());
    for (const PoseObservation& observation : observations)
      whitening_.push_back(Usable(observation) ? Whitening(observation.noise) : Whitening());
  }

  /// The observations that take part: all usable ones before the first round, inliers after.
  /// Returns their number.
  int Activate(const SE3& pose, bool only_inliers) {
    const double bound = only_inliers ? chi_square_ : std::numeric_limits<double>::max();
    int count = 0;
    for (size_t i = 0; i < observations_.size(); ++i) {
      active_[i] = Usable(observations_[i]) && ChiSquare(i, pose) <= bound;
      count += active_[i];
    }
    return count;
  }

  Equations Linearise(const SE3& pose, bool robust) const {
    Equations equations;
    const Eigen::Matrix3d rotation = pose.RotationMatrix();
    const HuberLoss loss{robust ? chi_square_ : std::numeric_limits<double>::max()};
    for (size_t i = 0; i < observations_.size(); ++i) {
      if (active_[i]) Accumulate(i, rotation, pose.translation(), loss, &equations);
    }
    equations.hessian.triangularView<Eigen::StrictlyUpper>() = equations.hessian.transpose();
    return equations;
  }

  const std::vector<uint8_t>& active() const { return active_; }

 private:
  /// Squared reprojection error in standard deviations; infinite behind the camera.
  double ChiSquare(size_t i, const SE3& pose) const {
    const Eigen::Vector2d error_px = ErrorPx(pinhole_, observations_[i], pose);
    if (!error_px.allFinite()) return std::numeric_limits<double>::infinity();
    return (whitening_[i] * error_px).squaredNorm();
  }

  void Accumulate(size_t i, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                  const HuberLoss& loss, Equations* equations) const {
    const PoseObservation& observation = observations_[i];
    const Whitening& whitening = whitening_[i];
    const Eigen::Vector3d point = rotation * observation.landmark_world + translation;
    const double inv_z = 1 / point.z();
    const double x = point.x() * inv_z, y = point.y() * inv_z;
    const double fx = pinhole_.fx, fy = pinhole_.fy;
    const double error_x = pinhole_.cx - observation.px.x() + fx * x;
    const double error_y = pinhole_.cy - observation.px.y() + fy * y;
    const double error_u = whitening.xx * error_x;
    const double error_v = whitening.yx * error_x + whitening.yy * error_y;
    const double squared = error_u * error_u + error_v * error_v;
    // Behind the camera, and further off than 45 degrees, an observation costs as much as there and
    // has no gradient: a step that pushes a point behind the camera is no gain, and the cost stays
    // continuous.
    const double max_squared = fx * fx * whitening.MeanSquaredGain();
    if (!InFrontOfCamera(point) || squared > max_squared) {
      equations->cost += loss.Cost(max_squared);
      return;
    }
    const double weight = loss.Weight(squared);
    equations->cost += loss.Cost(squared);

    Vector6d row_x, row_y;
    row_x << fx * inv_z, 0, -fx * x * inv_z, -fx * x * y, fx * (1 + x * x), -fx * y;
    row_y << 0, fy * inv_z, -fy * y * inv_z, -fy * (1 + y * y), fy * x * y, fy * x;
    const Vector6d row_u = whitening.xx * row_x;
    const Vector6d row_v = whitening.yx * row_x + whitening.yy * row_y;
    const Vector6d weighted_u = weight * row_u, weighted_v = weight * row_v;
    for (int column = 0; column < 6; ++column) {
      for (int row = column; row < 6; ++row) {
        equations->hessian(row, column) +=
            weighted_u[column] * row_u[row] + weighted_v[column] * row_v[row];
      }
    }
    equations->gradient += error_u * weighted_u + error_v * weighted_v;
  }

  const Pinhole& pinhole_;
  const std::vector<PoseObservation>& observations_;
  const double chi_square_;
  std::vector<Whitening> whitening_;
  std::vector<uint8_t> active_;
};

SE3 Minimise(const PoseProblem& problem, const SE3& initial, bool robust, int iterations) {
  return MinimiseDamped(
      initial, iterations, [&](const SE3& pose) { return problem.Linearise(pose, robust); },
      [](const SE3& pose, const Vector6d& step) { return SE3::Exp(step) * pose; });
}

void CheckPinhole(const Pinhole& pinhole) {
  if (!(pinhole.fx > 0 && pinhole.fy > 0 &&
        std::isfinite(pinhole.fx + pinhole.fy + pinhole.cx + pinhole.cy))) {
    throw Error("pinhole: found fx {} fy {} cx {} cy {}, expected finite values, fx and fy > 0",
                pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy);
  }
}

bool Finite(const SE3& pose) {
  return pose.translation().allFinite() && pose.rotation().coeffs().allFinite();
}

/// Fills inlier, inlier_count and rms_px.
void Classify(const Pinhole& pinhole, const std::vector<PoseObservation>& observations,
              const std::vector<uint8_t>& inlier, MotionOnlyResult* result) {
  result->inlier = inlier;
  double squared_sum = 0;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!inlier[i]) continue;
    ++result->inlier_count;
    squared_sum += ErrorPx(pinhole, observations[i], result->cam_from_world).squaredNorm();
  }
  if (result->inlier_count > 0) result->rms_px = std::sqrt(squared_sum / result->inlier_count);
}

}  // namespace

void MotionOnlyOptions::Check() const { CheckOptions("", *this); }

MotionOnlyResult OptimisePose(const Pinhole& pinhole,
                              const std::vector<PoseObservation>& observations,
                              const SE3& initial_cam_from_world, const MotionOnlyOptions& options) {
  options.Check();
  CheckPinhole(pinhole);
  MotionOnlyResult result;
  result.cam_from_world = initial_cam_from_world;
  result.inlier.assign(observations.size(), 0);
  if (!Finite(initial_cam_from_world)) return result;

  PoseProblem problem(pinhole, observations, options);
  int active = problem.Activate(initial_cam_from_world, false);
  SE3 pose = initial_cam_from_world;
  for (int round = 0; round < options.rounds && active >= kMinObservations; ++round) {
    const bool robust = round + 1 < options.rounds || options.rounds == 1;
    pose = Minimise(problem, pose, robust, options.iterations);
    active = problem.Activate(pose, true);
  }
  if (active >= kMinObservations) {
    result.cam_from_world = pose;
    result.information = problem.Linearise(pose, false).hessian;
  } else {
    problem.Activate(initial_cam_from_world, true);
  }
  Classify(pinhole, observations, problem.active(), &result);
  return result;
}

}  // namespace deepuav
