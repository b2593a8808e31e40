#include "deepuav/estimation/poses/sim3_optimisation.h"

#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/option_check.h"
#include "deepuav/estimation/poses/reprojection.h"
#include "deepuav/estimation/solvers/damped_gauss_newton.h"

namespace deepuav {
namespace {

constexpr int kMinCorrespondences = 3;
constexpr int kScale = 6;  // Of the tangent's parameters.

using Matrix27d = Eigen::Matrix<double, 2, 7>;
using Equations = NormalEquations<7>;

double ChiSquare(const Pinhole& pinhole, const Eigen::Vector3d& point, const Eigen::Vector2d& px,
                 double sigma_px) {
  if (!InFrontOfCamera(point)) return std::numeric_limits<double>::infinity();
  return (pinhole.Project(point) - px).squaredNorm() / (sigma_px * sigma_px);
}

/// d (q + translation + rotation x q + log_scale q) / d tangent, from the left times `rows`.
Matrix27d TangentJacobian(const Matrix23d& rows, const Eigen::Vector3d& q) {
  Matrix27d jacobian;
  jacobian.leftCols<6>() = PoseJacobian(rows, q);
  jacobian.col(kScale) = rows * q;
  return jacobian;
}

class Sim3Problem {
 public:
  Sim3Problem(const Pinhole& pinhole, const std::vector<Sim3Correspondence>& correspondences,
              const Sim3OptimisationOptions& options)
      : pinhole_(pinhole), correspondences_(correspondences), options_(options) {
    active_.resize(correspondences.size());
  }

  /// The correspondences that take part: all that the estimate leaves in front of the cameras
  /// before the first round, inliers after. Returns their number.
  int Activate(const Sim3& a_from_b, bool only_inliers) {
    const double bound = only_inliers ? options_.chi_square : std::numeric_limits<double>::max();
    const Sim3 b_from_a = a_from_b.Inverse();
    int count = 0;
    for (size_t i = 0; i < correspondences_.size(); ++i) {
      const Sim3Correspondence& c = correspondences_[i];
      active_[i] = UsableCorrespondence(c) &&
                   ReprojectBothWays(pinhole_, c, a_from_b, b_from_a).larger() <= bound;
      count += active_[i];
    }
    return count;
  }

  Equations Linearise(const Sim3& a_from_b, bool robust) const {
    Equations equations;
    const HuberLoss loss{robust ? options_.chi_square : std::numeric_limits<double>::max()};
    const Sim3 b_from_a = a_from_b.Inverse();
    const Eigen::Matrix3d inverse_matrix =
        b_from_a.scale() * b_from_a.rotation().toRotationMatrix();
    for (size_t i = 0; i < correspondences_.size(); ++i) {
      if (!active_[i]) continue;
      const Sim3Correspondence& c = correspondences_[i];
      const Eigen::Vector3d in_a = a_from_b * c.point_b;
      Accumulate(in_a, c.px_a, c.sigma_a_px, Eigen::Matrix3d::Identity(), in_a, loss, &equations);
      // b_from_a moves by the inverse of the perturbation, which acts on point_a first.
      Accumulate(b_from_a * c.point_a, c.px_b, c.sigma_b_px, -inverse_matrix, c.point_a, loss,
                 &equations);
    }
    equations.hessian.triangularView<Eigen::StrictlyUpper>() = equations.hessian.transpose();
    return equations;
  }

  const std::vector<uint8_t>& active() const { return active_; }

 private:
  /// Adds the error of `point` in its camera; a tangent moves it by point_from_moved * (the move of
  /// the point `moved`).
  void Accumulate(const Eigen::Vector3d& point, const Eigen::Vector2d& px, double sigma_px,
                  const Eigen::Matrix3d& point_from_moved, const Eigen::Vector3d& moved,
                  const HuberLoss& loss, Equations* equations) const {
    // As in motion-only optimisation: behind the camera, and further off than 45 degrees, an error
    // costs as much as there and has no gradient.
    const double per_sigma = 1 / sigma_px;
    const double max_squared = pinhole_.fx * pinhole_.fx * per_sigma * per_sigma;
    const double squared = ChiSquare(pinhole_, point, px, sigma_px);
    if (!(squared <= max_squared)) {
      equations->cost += loss.Cost(max_squared);
      return;
    }
    equations->cost += loss.Cost(squared);
    const Eigen::Vector2d error = per_sigma * (pinhole_.Project(point) - px);
    const Matrix23d rows = per_sigma * pinhole_.ProjectJacobian(point) * point_from_moved;
    const Matrix27d jacobian = TangentJacobian(rows, moved);
    const double weight = loss.Weight(squared);
    for (int column = 0; column < 7; ++column) {
      const Eigen::Vector2d weighted = weight * jacobian.col(column);
      for (int row = column; row < 7; ++row) {
        equations->hessian(row, column) += weighted.dot(jacobian.col(row));
      }
      equations->gradient[column] += weighted.dot(error);
    }
  }

  const Pinhole& pinhole_;
  const std::vector<Sim3Correspondence>& correspondences_;
  const Sim3OptimisationOptions& options_;
  std::vector<uint8_t> active_;
};

void SeparateScale(double diagonal, Equations* equations) {
  equations->hessian.row(kScale).setZero();
  equations->hessian.col(kScale).setZero();
  equations->hessian(kScale, kScale) = diagonal;
  equations->gradient[kScale] = 0;
}

Sim3 Minimise(const Sim3Problem& problem, const Sim3& initial, bool robust,
              const Sim3OptimisationOptions& options) {
  const auto linearise = [&](const Sim3& estimate) {
    Equations equations = problem.Linearise(estimate, robust);
    if (options.fixed_scale) SeparateScale(1, &equations);
    return equations;
  };
  const auto move = [](const Sim3& estimate, const Vector7d& step) {
    return Sim3::Exp(step) * estimate;
  };
  return MinimiseDamped(initial, options.iterations, linearise, move);
}

void CheckPinhole(const Pinhole& pinhole) {
  if (!(pinhole.fx > 0 && pinhole.fy > 0 &&
        std::isfinite(pinhole.fx + pinhole.fy + pinhole.cx + pinhole.cy))) {
    throw Error("pinhole: found fx {} fy {} cx {} cy {}, expected finite values, fx and fy > 0",
                pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy);
  }
}

bool Finite(const Sim3& transform) {
  return transform.scale() > 0 && std::isfinite(transform.scale()) &&
         transform.translation().allFinite() && transform.rotation().coeffs().allFinite();
}

/// Fills inlier, inlier_count and rms_px.
void Classify(const Pinhole& pinhole, const std::vector<Sim3Correspondence>& correspondences,
              const std::vector<uint8_t>& inlier, Sim3OptimisationResult* result) {
  result->inlier = inlier;
  const Sim3 b_from_a = result->a_from_b.Inverse();
  double squared_sum = 0;
  for (size_t i = 0; i < correspondences.size(); ++i) {
    if (!inlier[i]) continue;
    ++result->inlier_count;
    const Sim3Correspondence& c = correspondences[i];
    const Sim3ChiSquares errors = ReprojectBothWays(pinhole, c, result->a_from_b, b_from_a);
    squared_sum += errors.in_a * c.sigma_a_px * c.sigma_a_px;
    squared_sum += errors.in_b * c.sigma_b_px * c.sigma_b_px;
  }
  if (result->inlier_count > 0) {
    result->rms_px = std::sqrt(squared_sum / (2 * result->inlier_count));
  }
}

}  // namespace

Sim3ChiSquares ReprojectBothWays(const Pinhole& pinhole, const Sim3Correspondence& correspondence,
                                 const Sim3& a_from_b, const Sim3& b_from_a) {
  const Sim3Correspondence& c = correspondence;
  return {ChiSquare(pinhole, a_from_b * c.point_b, c.px_a, c.sigma_a_px),
          ChiSquare(pinhole, b_from_a * c.point_a, c.px_b, c.sigma_b_px)};
}

bool UsableCorrespondence(const Sim3Correspondence& correspondence) {
  const Sim3Correspondence& c = correspondence;
  return InFrontOfCamera(c.point_a) && InFrontOfCamera(c.point_b) && c.px_a.allFinite() &&
         c.px_b.allFinite() && c.sigma_a_px > 0 && c.sigma_b_px > 0 &&
         std::isfinite(c.sigma_a_px) && std::isfinite(c.sigma_b_px);
}

void Sim3OptimisationOptions::Check() const { CheckOptions("", *this); }

Sim3OptimisationResult OptimiseSim3(const Pinhole& pinhole,
                                    const std::vector<Sim3Correspondence>& correspondences,
                                    const Sim3& initial_a_from_b,
                                    const Sim3OptimisationOptions& options) {
  options.Check();
  CheckPinhole(pinhole);
  Sim3OptimisationResult result;
  result.a_from_b = initial_a_from_b;
  result.inlier.assign(correspondences.size(), 0);
  if (!Finite(initial_a_from_b)) return result;

  Sim3Problem problem(pinhole, correspondences, options);
  int active = problem.Activate(initial_a_from_b, false);
  Sim3 estimate = initial_a_from_b;
  for (int round = 0; round < options.rounds && active >= kMinCorrespondences; ++round) {
    const bool robust = round + 1 < options.rounds || options.rounds == 1;
    estimate = Minimise(problem, estimate, robust, options);
    active = problem.Activate(estimate, true);
  }
  if (active >= kMinCorrespondences) {
    result.a_from_b = estimate;
    Equations equations = problem.Linearise(estimate, false);
    if (options.fixed_scale) SeparateScale(0, &equations);
    result.information = equations.hessian;
  } else {
    problem.Activate(initial_a_from_b, true);
  }
  Classify(pinhole, correspondences, problem.active(), &result);
  return result;
}

}  // namespace deepuav
