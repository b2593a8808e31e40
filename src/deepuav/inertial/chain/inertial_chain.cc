#include "deepuav/inertial/chain/inertial_chain.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "deepuav/inertial/chain/imu_factor.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
/// Whitened norm of three residuals from which a pose counts less.
constexpr double kHuber = 3;
/// Of a state that no measurement holds, so that the matrix can be factorised.
constexpr double kWeakest = 1e-8;
/// The clock drifts by less.
constexpr double kClockWalk_s_sqrt_s = 1e-6;

using Block = Eigen::Matrix<double, kStateSize, kStateSize>;
using Panel = Eigen::Matrix<double, Eigen::Dynamic, kStateSize>;
constexpr size_t kBlockValues = kStateSize * kStateSize;

/// Collects the normal equations.
class Sum {
 public:
  Sum(size_t states, InertialChain* chain) : states_(states), chain_(chain) {
    chain->hessian.assign(kBlockValues * (2 * states - 1), 0);
    chain->gradient.setZero(static_cast<Eigen::Index>(kStateSize * states));
  }

  /// The rows of state k in its own column, then those of the next state.
  Eigen::Map<Panel> Column(size_t k) {
    const Eigen::Index rows = k + 1 < states_ ? 2 * kStateSize : kStateSize;
    return {chain_->hessian.data() + 2 * kBlockValues * k, rows, kStateSize};
  }

  template <typename Jacobian, typename Residual>
  void Add(size_t k, const Jacobian& whitened, const Residual& residual, double weight) {
    Column(k).template topRows<kStateSize>().noalias() += weight * whitened.transpose() * whitened;
    Gradient(k).noalias() += weight * whitened.transpose() * residual;
  }

  template <typename Jacobian, typename Residual>
  void AddPair(size_t k, const Jacobian& first, const Jacobian& last, const Residual& residual) {
    Add(k, first, residual, 1);
    Add(k + 1, last, residual, 1);
    Column(k).template bottomRows<kStateSize>().noalias() += last.transpose() * first;
    chain_->cost += residual.squaredNorm();
  }

  void AddCost(double cost) { chain_->cost += cost; }

 private:
  Eigen::VectorBlock<Eigen::VectorXd, kStateSize> Gradient(size_t k) {
    return chain_->gradient.segment<kStateSize>(kStateSize * static_cast<Eigen::Index>(k));
  }

  const size_t states_;
  InertialChain* chain_;
};

template <int kRows>
using Rows = Eigen::Matrix<double, kRows, kStateSize>;

void AddRobust(size_t k, const Rows<3>& whitened, const Eigen::Vector3d& residual, Sum* sum) {
  const double norm = residual.norm();
  sum->Add(k, whitened, residual, norm <= kHuber ? 1 : kHuber / norm);
  sum->AddCost(norm <= kHuber ? norm * norm : kHuber * (2 * norm - kHuber));
}

Eigen::Vector3d TurnResidual(const InertialProblem& problem, const InertialState& state, size_t k) {
  return RotationLog(problem.WorldFromImu(problem.path[k]).conjugate() * state.world_from_imu);
}

Eigen::Vector3d PositionResidual(const InertialProblem& problem, const InertialState& state,
                                 size_t k) {
  return state.camera - problem.path[k].world_from_cam.translation();
}

void AddPose(const InertialProblem& problem, const InertialState& state,
             const InertialMotion& motion, size_t k, Sum* sum) {
  const Eigen::Vector3d turn = TurnResidual(problem, state, k);
  const Eigen::Matrix3d by_right = RotationLeftJacobian(-turn).inverse();
  Rows<3> jacobian = Rows<3>::Zero();
  jacobian.block<3, 3>(0, kRotation) = by_right;
  jacobian.col(kClock) = -by_right * motion.angular_velocity;
  const double per_turn = 1 / problem.turn_sigma_rad[k];
  AddRobust(k, per_turn * jacobian, per_turn * turn, sum);

  jacobian.setZero();
  jacobian.block<3, 3>(0, kPosition).setIdentity();
  jacobian.col(kClock) = -motion.camera_per_s;
  const double per_position = 1 / problem.position_sigma[k];
  AddRobust(k, per_position * jacobian, per_position * PositionResidual(problem, state, k), sum);
}

/// The residual's covariance beside the integration's: a path that bends turns as it goes.
Matrix9d CovarianceWithPath(const InertialProblem& problem, const Preintegration& motion) {
  const double walk = kDegree * problem.options.turn_walk_deg_sqrt_s;
  Matrix9d covariance = motion.covariance;
  covariance.diagonal().segment<3>(kTurned).array() += walk * walk * motion.duration_s;
  return covariance;
}

void AddMotion(const InertialProblem& problem, const InertialState& first,
               const InertialState& last, const Preintegration& motion, size_t k, Sum* sum,
               double* chi_square) {
  const ImuResidual residual =
      ResidualOf(first, last, motion, problem.camera_in_imu_m(), problem.options.gravity_m_s2);
  const Eigen::LLT<Matrix9d> covariance(CovarianceWithPath(problem, motion));
  const auto whiten = covariance.matrixL();
  const Vector9d value = whiten.solve(residual.value);
  sum->AddPair(k, Rows<9>(whiten.solve(residual.by_first)), Rows<9>(whiten.solve(residual.by_last)),
               value);
  *chi_square += value.squaredNorm();
}

/// What walks from state to state.
constexpr int kWalking = 10;
using Vector1 = Eigen::Matrix<double, 1, 1>;

void AddWalks(const InertialProblem& problem, const InertialState& first, const InertialState& last,
              double seconds, size_t k, Sum* sum) {
  const ImuNoise& noise = problem.imu->noise();
  const InertialOptions& options = problem.options;
  const Eigen::Matrix<double, 3, 2> axes = AxesAcross(first.down);
  Eigen::Matrix<double, kWalking, 1> residual, walk;
  const auto place = [](int parameter) { return parameter - kGyroscopeBias; };
  const auto put = [&](int parameter, const auto& difference, double sigma) {
    constexpr int kCount = std::remove_cvref_t<decltype(difference)>::RowsAtCompileTime;
    residual.template segment<kCount>(place(parameter)) = difference;
    walk.template segment<kCount>(place(parameter)).setConstant(sigma);
  };
  put(kGyroscopeBias, Eigen::Vector3d(last.bias.gyroscope_rad_s - first.bias.gyroscope_rad_s),
      noise.gyroscope_random_walk);
  put(kAccelerometerBias,
      Eigen::Vector3d(last.bias.accelerometer_m_s2 - first.bias.accelerometer_m_s2),
      noise.accelerometer_random_walk);
  put(kLogScaleOfMap, Vector1(last.log_scale - first.log_scale), options.scale_walk_sqrt_s);
  put(kDown, Eigen::Vector2d(axes.transpose() * (last.down - first.down)),
      kDegree * options.level_walk_deg_sqrt_s);
  put(kClock, Vector1(last.clock_offset_s - first.clock_offset_s), kClockWalk_s_sqrt_s);
  const Eigen::Matrix<double, kWalking, 1> per_sigma = (std::sqrt(seconds) * walk).cwiseInverse();
  Rows<kWalking> by_first = Rows<kWalking>::Zero(), by_last = by_first;
  for (int row = 0; row < kWalking; ++row) {
    by_first(row, kGyroscopeBias + row) = -per_sigma[row];
    by_last(row, kGyroscopeBias + row) = per_sigma[row];
  }
  constexpr int kDownRow = kDown - kGyroscopeBias;
  by_last.block<2, 2>(kDownRow, kDown) =
      per_sigma.segment<2>(kDownRow).asDiagonal() * (axes.transpose() * AxesAcross(last.down));
  sum->AddPair(k, by_first, by_last,
               Eigen::Matrix<double, kWalking, 1>(per_sigma.cwiseProduct(residual)));
}

void AddPriors(const InertialProblem& problem, const InertialState& state, Sum* sum) {
  const InertialOptions& options = problem.options;
  Eigen::Matrix<double, 7, 1> residual, sigma;
  residual.segment<3>(0) = state.bias.gyroscope_rad_s;
  residual.segment<3>(3) = state.bias.accelerometer_m_s2;
  residual[6] = state.clock_offset_s;
  sigma.segment<3>(0).setConstant(options.gyroscope_bias_sigma_rad_s);
  sigma.segment<3>(3).setConstant(options.accelerometer_bias_sigma_m_s2);
  sigma[6] = options.clock_sigma_s;
  residual = residual.cwiseQuotient(sigma);
  Rows<7> jacobian = Rows<7>::Zero();
  for (int row = 0; row < 6; ++row) jacobian(row, kGyroscopeBias + row) = 1 / sigma[row];
  jacobian(6, kClock) = 1 / sigma[6];
  sum->Add(0, jacobian, residual, 1);
  sum->AddCost(residual.squaredNorm());
}

}  // namespace

BlockPattern ChainPattern(size_t states) {
  std::vector<std::pair<int, int>> pairs;
  for (int k = 0; k + 1 < static_cast<int>(states); ++k) pairs.emplace_back(k + 1, k);
  return BlockPattern::OfPairs(static_cast<int>(states), std::move(pairs));
}

Timestamp OnSensorClock(Timestamp time, double clock_offset_s) {
  return {time.nanoseconds - std::llround(1e9 * clock_offset_s)};
}

void InertialProblem::LinkStates() {
  linked.assign(size() - 1, 0);
  for (size_t k = 0; k + 1 < size(); ++k) {
    const Timestamp first = path[k].time, last = path[k + 1].time;
    linked[k] = SecondsBetween(first, last) <= options.max_path_gap_s &&
                imu->Covers(OnSensorClock(first, options.max_clock_offset_s),
                            OnSensorClock(last, -options.max_clock_offset_s));
  }
}

std::vector<double> InertialChain::Damped(double damping) const {
  std::vector<double> damped = hessian;
  for (size_t column = 0; column < damped.size(); column += 2 * kBlockValues) {
    const bool is_last = column + kBlockValues >= damped.size();
    const size_t rows = is_last ? kStateSize : 2 * kStateSize;
    for (size_t i = 0; i < kGyroscopeBias; ++i) damped[column + i * rows + i] *= 1 + damping;
  }
  return damped;
}

InertialChain Linearise(const InertialProblem& problem, const std::vector<InertialState>& states) {
  InertialChain chain;
  Sum sum(states.size(), &chain);
  int integrated = 0;
  const auto moment = [&](size_t k) {
    return OnSensorClock(problem.path[k].time, states[k].clock_offset_s);
  };
  for (size_t k = 0; k < states.size(); ++k) {
    sum.Column(k).diagonal().array() += kWeakest;
    const std::optional<ImuSample> sample = problem.imu->At(moment(k));
    chain.motions.push_back(sample ? MotionOf(states[k], *sample, problem.camera_in_imu_m(),
                                              problem.options.gravity_m_s2)
                                   : InertialMotion{});
    AddPose(problem, states[k], chain.motions[k], k, &sum);
    if (k + 1 == states.size()) break;
    const double seconds = SecondsBetween(problem.path[k].time, problem.path[k + 1].time);
    AddWalks(problem, states[k], states[k + 1], seconds, k, &sum);
    if (!problem.linked[k]) continue;
    const auto motion = problem.imu->Between(moment(k), moment(k + 1), states[k].bias);
    if (!motion) continue;
    AddMotion(problem, states[k], states[k + 1], *motion, k, &sum, &chain.imu_chi_square);
    ++integrated;
  }
  AddPriors(problem, states[0], &sum);
  chain.imu_chi_square /= std::max(1, integrated) * 9;
  return chain;
}

std::vector<Vector6d> PathResiduals(const InertialProblem& problem,
                                    const std::vector<InertialState>& states) {
  std::vector<Vector6d> residuals;
  for (size_t k = 0; k < states.size(); ++k) {
    Vector6d& residual = residuals.emplace_back();
    residual.head<3>() = TurnResidual(problem, states[k], k);
    residual.tail<3>() = PositionResidual(problem, states[k], k);
  }
  return residuals;
}

}  // namespace deepuav
