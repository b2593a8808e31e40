#include "deepuav/estimation/paths/smooth_path.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "deepuav/base/option_check.h"
#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {
namespace {

constexpr int kPoseSize = 6;
constexpr double kConvergedStep = 1e-9;

/// Block tridiagonal and symmetric: one block a camera, and what couples it with the next.
struct ChainEquations {
  std::vector<MovingCameraMatrix> own, with_next;
  std::vector<MovingCameraStep> gradient;

  explicit ChainEquations(size_t size)
      : own(size, MovingCameraMatrix::Zero()),
        with_next(size, MovingCameraMatrix::Zero()),
        gradient(size, MovingCameraStep::Zero()) {}

  /// Takes the pose, not the pace, out of what is sought.
  void Hold(size_t i) {
    const auto pose = Eigen::seqN(0, kPoseSize);
    own[i](pose, Eigen::all).setZero();
    own[i](Eigen::all, pose).setZero();
    own[i](pose, pose).setIdentity();
    with_next[i](pose, Eigen::all).setZero();
    if (i > 0) with_next[i - 1](Eigen::all, pose).setZero();
    gradient[i](pose).setZero();
  }

  /// The steps to the minimum, by block Cholesky; nothing where it has none.
  std::optional<std::vector<MovingCameraStep>> Solve() {
    for (size_t i = 0; i < own.size(); ++i) {
      const Eigen::LLT<MovingCameraMatrix> factor(own[i]);
      if (factor.info() != Eigen::Success) return std::nullopt;
      if (i + 1 == own.size()) break;
      const MovingCameraMatrix by_own = factor.solve(with_next[i]);
      own[i + 1] -= with_next[i].transpose() * by_own;
      gradient[i + 1] -= by_own.transpose() * gradient[i];
    }
    std::vector<MovingCameraStep> steps(own.size());
    for (size_t i = own.size(); i-- > 0;) {
      MovingCameraStep right = -gradient[i];
      if (i + 1 < own.size()) right -= with_next[i] * steps[i + 1];
      steps[i] = own[i].llt().solve(right);
      if (!steps[i].allFinite()) return std::nullopt;
    }
    return steps;
  }
};

std::vector<MovingCamera> StartOf(std::span<const PathPose> path) {
  std::vector<MovingCamera> cameras;
  for (const PathPose& pose : path) cameras.emplace_back(pose.cam_from_world);
  for (size_t i = 0; i < cameras.size(); ++i) {
    const size_t from = std::min(i, cameras.size() - 2);
    const MovingCamera &a = cameras[from], &b = cameras[from + 1];
    const double over_s = path[from + 1].time_s - path[from].time_s;
    cameras[i].velocity_world_per_s = (b.centre_world - a.centre_world) / over_s;
    cameras[i].turn_cam_rad_per_s =
        RotationLog(a.world_from_cam.conjugate() * b.world_from_cam) / over_s;
  }
  return cameras;
}

void AddMotion(const PathPose& from, const PathPose& to, const MovingCamera& first,
               const MovingCamera& second, size_t i, ChainEquations* equations) {
  MovingCameraMatrix by_first, by_second;
  const MovingCameraStep error = SmoothMotionError(first, second, to.time_s - from.time_s,
                                                   from.to_next, &by_first, &by_second);
  equations->own[i] += by_first.transpose() * by_first;
  equations->own[i + 1] += by_second.transpose() * by_second;
  equations->with_next[i] += by_first.transpose() * by_second;
  equations->gradient[i] += by_first.transpose() * error;
  equations->gradient[i + 1] += by_second.transpose() * error;
}

void AddPose(const PathPose& pose, const MovingCamera& camera, double chi_square, size_t i,
             ChainEquations* equations) {
  const SE3 cam_from_world = camera.CamFromWorld();
  const Vector6d error = (cam_from_world * pose.cam_from_world.Inverse()).Log();
  // A twist from the left moves the centre by -R and turns the other way.
  Matrix6d by_parameters = -Matrix6d::Identity();
  by_parameters.topLeftCorner<3, 3>() = -cam_from_world.RotationMatrix();
  const double weight = HuberLoss{chi_square}.Weight(error.dot(pose.information * error));
  const Matrix6d weighted = weight * by_parameters.transpose() * pose.information;
  equations->own[i].topLeftCorner<kPoseSize, kPoseSize>() += weighted * by_parameters;
  equations->gradient[i].head<kPoseSize>() += weighted * error;
}

ChainEquations Linearise(std::span<const PathPose> path, const std::vector<MovingCamera>& cameras,
                         const SmoothPathOptions& options) {
  ChainEquations equations(path.size());
  for (size_t i = 0; i + 1 < path.size(); ++i)
    AddMotion(path[i], path[i + 1], cameras[i], cameras[i + 1], i, &equations);
  for (size_t i = 0; i < path.size(); ++i) {
    if (path[i].is_known) {
      equations.Hold(i);
    } else {
      AddPose(path[i], cameras[i], options.chi_square, i, &equations);
    }
  }
  return equations;
}

bool IsUsable(std::span<const PathPose> path) {
  if (path.size() < 3) return false;
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    if (!path[i].to_next.usable() || !(path[i + 1].time_s > path[i].time_s)) return false;
  }
  return true;
}

}  // namespace

void SmoothPathOptions::Check() const { CheckOptions("smoothing", *this); }

std::optional<std::vector<SE3>> SmoothPath(std::span<const PathPose> path,
                                           const SmoothPathOptions& options) {
  if (!IsUsable(path)) return std::nullopt;
  std::vector<MovingCamera> cameras = StartOf(path);
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    const auto steps = Linearise(path, cameras, options).Solve();
    if (!steps) return std::nullopt;
    double largest = 0;
    for (size_t i = 0; i < cameras.size(); ++i) {
      cameras[i] = Moved(cameras[i], (*steps)[i]);
      largest = std::max(largest, (*steps)[i].cwiseAbs().maxCoeff());
    }
    if (largest < kConvergedStep) break;
  }
  std::vector<SE3> poses;
  for (size_t i = 0; i < cameras.size(); ++i)
    poses.push_back(path[i].is_known ? path[i].cam_from_world : cameras[i].CamFromWorld());
  return poses;
}

}  // namespace deepuav
