#include "deepuav/estimation/poses/turning_pose.h"

#include <cmath>
#include <vector>

#include "deepuav/base/option_check.h"
#include "deepuav/estimation/solvers/damped_gauss_newton.h"

namespace deepuav {
namespace {

constexpr int kPose = 6, kTurn = 3;

/// Squared error at which an observation behind the camera stands, so that no step gains by pushing
/// one there.
constexpr double kBehind = 1e6;

/// Turn and bend as one vector, with the pose that they go with.
struct State {
  SE3 cam_from_world;
  Eigen::Matrix<double, 2 * kTurn, 1> turning = Eigen::Matrix<double, 2 * kTurn, 1>::Zero();
};

/// kParameters: of the pose, with the turn, and with its bend.
template <int kParameters>
class Problem {
 public:
  using Equations = NormalEquations<kParameters>;

  Problem(const Pinhole& pinhole, std::span<const RowObservation> observations,
          const TurningPoseOptions& options)
      : pinhole_(pinhole), soft_squared_(options.soft_sigmas * options.soft_sigmas) {
    for (const RowObservation& observation : observations) {
      const PoseObservation& seen = observation.seen;
      if (seen.landmark_world.allFinite() && seen.px.allFinite() && seen.noise.usable())
        used_.push_back({&observation, Whitening(seen.noise)});
    }
    information_.template head<kTurn>().setConstant(std::pow(options.turn_sigma_rad, -2));
    information_.template tail<kTurn>().setConstant(std::pow(options.bend_sigma_rad, -2));
  }

  size_t size() const { return used_.size(); }

  Equations Linearise(const State& state) const {
    Equations equations;
    equations.cost = CostOfObservations(state, &equations);
    for (int k = 0; k < kParameters - kPose; ++k) {
      equations.hessian(kPose + k, kPose + k) += information_[k];
      equations.gradient[kPose + k] += information_[k] * state.turning[k];
      equations.cost += information_[k] * state.turning[k] * state.turning[k];
    }
    return equations;
  }

  double CostOfObservations(const State& state, Equations* equations) const {
    double cost = 0;
    for (const Used& used : used_) cost += Accumulate(used, state, equations);
    return cost;
  }

 private:
  using Jacobian = Eigen::Matrix<double, 2, kParameters>;
  struct Used {
    const RowObservation* observation;
    Whitening whitening;
  };

  double Accumulate(const Used& used, const State& state, Equations* equations) const {
    const auto& [seen, moment] = *used.observation;
    const Eigen::Vector3d point = state.cam_from_world * seen.landmark_world;
    if (!InFrontOfCamera(point)) return soft_squared_ * std::log1p(kBehind / soft_squared_);
    const Matrix26d pose = PoseJacobian(pinhole_.ProjectJacobian(point), point);
    Jacobian jacobian;
    jacobian.template leftCols<kPose>() = pose;
    if constexpr (kParameters > kPose)
      jacobian.template middleCols<kTurn>(kPose) = TurnJacobian(pose, moment);
    if constexpr (kParameters > kPose + kTurn)
      jacobian.template rightCols<kTurn>() = moment * TurnJacobian(pose, moment);
    Eigen::Vector2d error_px = pinhole_.Project(point) - seen.px;
    error_px += jacobian.template rightCols<kParameters - kPose>() *
                state.turning.template head<kParameters - kPose>();
    const Jacobian white = used.whitening * jacobian;
    const Eigen::Vector2d error = used.whitening * error_px;
    const double squared = error.squaredNorm();
    const double weight = 1 / (1 + squared / soft_squared_);
    equations->hessian += weight * white.transpose() * white;
    equations->gradient += weight * white.transpose() * error;
    return soft_squared_ * std::log1p(squared / soft_squared_);
  }

  const Pinhole& pinhole_;
  const double soft_squared_;
  std::vector<Used> used_;
  Eigen::Matrix<double, 2 * kTurn, 1> information_;
};

/// Standard deviation of an axis of the turn, as large as the errors show themselves to be.
template <int kParameters>
double TurnSigma(const Problem<kParameters>& problem, const State& state, double cost) {
  using Matrix = typename NormalEquations<kParameters>::Matrix;
  const Matrix covariance = problem.Linearise(state).hessian.ldlt().solve(Matrix::Identity());
  const double variance = covariance.diagonal().template segment<kTurn>(kPose).mean();
  const double freedom = 2.0 * static_cast<double>(problem.size()) - kParameters;
  return std::sqrt(variance * cost / freedom);
}

template <int kParameters>
std::optional<TurningPose> Optimise(const Pinhole& pinhole,
                                    std::span<const RowObservation> observations,
                                    const SE3& initial, const TurningPoseOptions& options) {
  const Problem<kParameters> problem(pinhole, observations, options);
  if (problem.size() < static_cast<size_t>(options.min_observations)) return std::nullopt;
  const auto move = [](const State& state, const auto& step) {
    State moved{SE3::Exp(step.template head<kPose>()) * state.cam_from_world, state.turning};
    moved.turning.template head<kParameters - kPose>() += step.template tail<kParameters - kPose>();
    return moved;
  };
  const State found = MinimiseDamped(
      State{.cam_from_world = initial}, options.iterations,
      [&problem](const State& state) { return problem.Linearise(state); }, move);
  TurningPose pose{found.cam_from_world, found.turning.template head<kTurn>(),
                   found.turning.template tail<kTurn>()};
  pose.used = static_cast<int>(problem.size());
  typename Problem<kParameters>::Equations unused;
  pose.cost = problem.CostOfObservations(found, &unused);
  if constexpr (kParameters > kPose) pose.turn_sigma_rad = TurnSigma(problem, found, pose.cost);
  return pose;
}

}  // namespace

void TurningPoseOptions::Check() const { CheckOptions("", *this); }

std::optional<TurningPose> OptimiseTurningPose(const Pinhole& pinhole,
                                               std::span<const RowObservation> observations,
                                               const SE3& initial_cam_from_world, TurnModel model,
                                               const TurningPoseOptions& options) {
  options.Check();
  switch (model) {
    case TurnModel::kNone:
      return Optimise<kPose>(pinhole, observations, initial_cam_from_world, options);
    case TurnModel::kTurn:
      return Optimise<kPose + kTurn>(pinhole, observations, initial_cam_from_world, options);
    case TurnModel::kTurnAndBend:
      return Optimise<kPose + 2 * kTurn>(pinhole, observations, initial_cam_from_world, options);
  }
  return std::nullopt;
}

}  // namespace deepuav
