#include "bundle_ceres.h"

#include <ceres/ceres.h>

#include <array>
#include <cmath>

#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {
namespace {

// Only plain arrays cross the border to Ceres: its library is built for another vector width than
// this code, so that Eigen's alignment differs.

using PoseArray = std::array<double, 7>;  // Quaternion x y z w, translation.

SE3 ToPose(const double* x) {
  return SE3(Eigen::Quaterniond(x[3], x[0], x[1], x[2]), Eigen::Vector3d(x[4], x[5], x[6]));
}

void FromPose(const SE3& pose, double* x) {
  Eigen::Map<Eigen::Vector4d> quaternion(x);
  quaternion = pose.rotation().coeffs();
  Eigen::Map<Eigen::Vector3d>(x + 4) = pose.translation();
}

/// Left-multiplied twists. The cost functions fill the first six columns with the derivative by the
/// twist, so that the chain rule must only drop the seventh.
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    FromPose(SE3::Exp(Eigen::Map<const Vector6d>(delta)) * ToPose(x), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* difference) const override {
    Eigen::Map<Vector6d>(difference, 6) = (ToPose(y) * ToPose(x).Inverse()).Log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  ReprojectionCost(const Pinhole& pinhole, const BundleObservation& observation)
      : pinhole_(pinhole), px_(observation.px), per_sigma_(1 / observation.noise.SigmaPx()) {}

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const SE3 pose = ToPose(parameters[0]);
    const Eigen::Vector3d point = pose * Eigen::Vector3d(parameters[1]);
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = per_sigma_ * (pinhole_.Project(point) - px_);
    if (!jacobians) return true;
    const double inv_z = 1 / point.z();
    Matrix23d by_point;
    by_point << pinhole_.fx * inv_z, 0, -pinhole_.fx * point.x() * inv_z * inv_z,  //
        0, pinhole_.fy * inv_z, -pinhole_.fy * point.y() * inv_z * inv_z;
    by_point *= per_sigma_;
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
      by_pose.leftCols<6>() = PoseJacobian(by_point, point);
      by_pose.col(6).setZero();
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_landmark(jacobians[1]);
      by_landmark = by_point * pose.RotationMatrix();
    }
    return true;
  }

 private:
  const Pinhole pinhole_;
  const Eigen::Vector2d px_;
  const double per_sigma_;
};

}  // namespace

CeresReport AdjustBundleByCeres(BundleProblem* problem, double chi_square, int iterations,
                                CeresSchur schur) {
  std::vector<PoseArray> poses(problem->cam_from_world.size());
  ceres::Problem::Options problem_options;
  problem_options.disable_all_safety_checks = true;
  problem_options.enable_fast_removal = false;
  PoseManifold manifold;
  ceres::HuberLoss loss(std::sqrt(chi_square));
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(problem_options);
  ceres::Solver::Options options;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& landmark : problem->landmarks_world) {
    ceres_problem.AddParameterBlock(landmark.data(), 3);
    options.linear_solver_ordering->AddElementToGroup(landmark.data(), 0);
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    FromPose(problem->cam_from_world[i], poses[i].data());
    ceres_problem.AddParameterBlock(poses[i].data(), 7, &manifold);
    options.linear_solver_ordering->AddElementToGroup(poses[i].data(), 1);
    if (problem->camera_fixed[i]) ceres_problem.SetParameterBlockConstant(poses[i].data());
  }
  for (const BundleObservation& o : problem->observations) {
    ceres_problem.AddResidualBlock(new ReprojectionCost(problem->pinhole, o), &loss,
                                   poses[o.camera].data(),
                                   problem->landmarks_world[o.landmark].data());
  }
  options.linear_solver_type =
      schur == CeresSchur::kDense ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  options.max_num_iterations = iterations;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 0;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  for (size_t i = 0; i < poses.size(); ++i) problem->cam_from_world[i] = ToPose(poses[i].data());
  return {static_cast<int>(summary.iterations.size()) - 1, 2 * summary.final_cost};
}

}  // namespace deepuav
