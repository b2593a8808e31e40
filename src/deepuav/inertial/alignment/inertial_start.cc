#include "deepuav/inertial/alignment/inertial_start.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/median.h"
#include "deepuav/inertial/chain/imu_factor.h"
#include "deepuav/inertial/paths/path_steps.h"

namespace deepuav {
namespace {

/// Between two poses of the start: long enough that their noise does not hide the motion.
constexpr double kStep_s = 0.5;
constexpr size_t kMinSteps = 8;
constexpr double kClockStep_s = 0.005;
constexpr int kBiasRounds = 2, kLevelRounds = 6;
/// Of the sum of two steps' velocities, where the robust loss begins.
constexpr double kVelocitySigma_m_s = 0.05;
constexpr double kMinTurnSigma_rad = 1e-4;

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

std::vector<PathStep> StepsOf(const InertialProblem& problem, double clock_offset_s,
                              const ImuBias& bias) {
  return StepsAlong(problem.path, *problem.imu, kStep_s, problem.options.max_path_gap_s,
                    clock_offset_s, bias);
}

Eigen::Vector3d TurnMisfit(const InertialProblem& problem, const PathStep& step) {
  return RotationLog(step.motion.rotation.conjugate() *
                     problem.WorldFromImu(*step.first).conjugate() *
                     problem.WorldFromImu(*step.last));
}

struct GyroscopeFit {
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  double misfit_rad = std::numeric_limits<double>::infinity();
};

/// Least squares of the turns, reweighted about their median.
GyroscopeFit FitGyroscope(const InertialProblem& problem, double clock_offset_s) {
  GyroscopeFit fit;
  for (int round = 0; round < kBiasRounds; ++round) {
    const std::vector<PathStep> steps = StepsOf(problem, clock_offset_s, {fit.bias, {0, 0, 0}});
    if (steps.size() < kMinSteps) return {};
    std::vector<double> norms;
    for (const PathStep& step : steps) norms.push_back(TurnMisfit(problem, step).norm());
    const double usual = std::max(Median(norms), kMinTurnSigma_rad);
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    double squares = 0, weights = 0;
    for (size_t i = 0; i < steps.size(); ++i) {
      const double weight = norms[i] <= 2 * usual ? 1 : 2 * usual / norms[i];
      const Eigen::Matrix3d by_bias = -steps[i].motion.by_bias.topLeftCorner<3, 3>();
      hessian += weight * by_bias.transpose() * by_bias;
      gradient += weight * by_bias.transpose() * TurnMisfit(problem, steps[i]);
      squares += weight * norms[i] * norms[i];
      weights += weight;
    }
    fit.misfit_rad = std::sqrt(squares / weights);
    fit.bias -= hessian.ldlt().solve(gradient);
  }
  return fit;
}

/// Scans the offsets and takes the best, held to 0 where turns do not tell it.
void FindGyroscopeAndClock(const InertialProblem& problem, InertialStart* start) {
  const InertialOptions& options = problem.options;
  double best = std::numeric_limits<double>::infinity();
  const int reach = static_cast<int>(std::floor(options.max_clock_offset_s / kClockStep_s));
  for (int i = -reach; i <= reach; ++i) {
    const double offset_s = kClockStep_s * i;
    const GyroscopeFit fit = FitGyroscope(problem, offset_s);
    const double held = offset_s / (4 * options.max_clock_offset_s + kClockStep_s);
    const double cost = fit.misfit_rad * (1 + held * held);
    if (!(cost < best)) continue;
    best = cost;
    start->clock_offset_s = offset_s;
    start->gyroscope_bias_rad_s = fit.bias;
    start->turn_misfit_rad = fit.misfit_rad;
  }
}

/// One triple of poses: three rows of A * [scale; gravity; accelerometer bias] = b.
struct Triple {
  Eigen::Matrix<double, 3, 7> a;
  Eigen::Vector3d b;
};

Triple TripleOf(const InertialProblem& problem, const PathStep& before, const PathStep& after) {
  const Eigen::Matrix3d at_first = problem.WorldFromImu(*before.first).toRotationMatrix();
  const Eigen::Matrix3d at_middle = problem.WorldFromImu(*before.last).toRotationMatrix();
  const Eigen::Matrix3d at_last = problem.WorldFromImu(*after.last).toRotationMatrix();
  const double seconds = before.motion.duration_s, seconds_after = after.motion.duration_s;
  const auto moved = [](const PathStep& step) -> Eigen::Vector3d {
    return (step.last->world_from_cam.translation() - step.first->world_from_cam.translation()) /
           step.motion.duration_s;
  };
  const Eigen::Vector3d lever = problem.camera_in_imu_m();
  const auto& by_before = before.motion.by_bias;
  const auto& by_after = after.motion.by_bias;
  Triple triple;
  triple.a.col(0) = moved(after) - moved(before);
  triple.a.block<3, 3>(0, 1) = -0.5 * (seconds + seconds_after) * Eigen::Matrix3d::Identity();
  triple.a.block<3, 3>(0, 4) = -(
      at_first * (by_before.block<3, 3>(kSpeeded, 3) - by_before.block<3, 3>(kMoved, 3) / seconds) +
      at_middle * by_after.block<3, 3>(kMoved, 3) / seconds_after);
  triple.b = at_first * (before.motion.velocity_m_s - before.motion.position_m / seconds) +
             at_middle * after.motion.position_m / seconds_after +
             (at_last - at_middle) * lever / seconds_after -
             (at_middle - at_first) * lever / seconds;
  return triple;
}

std::vector<Triple> TriplesOf(const InertialProblem& problem, const std::vector<PathStep>& steps) {
  std::vector<Triple> triples;
  for (size_t i = 0; i + 1 < steps.size(); ++i) {
    if (steps[i].last == steps[i + 1].first)
      triples.push_back(TripleOf(problem, steps[i], steps[i + 1]));
  }
  return triples;
}

/// Gravity of known strength: first free, then across its direction only.
Vector7 SolveLevel(const std::vector<Triple>& triples, const InertialOptions& options) {
  Vector7 solution = Vector7::Zero();
  Eigen::Matrix<double, 7, 6> directions;
  for (int round = 0; round < kLevelRounds; ++round) {
    Matrix7 hessian = Matrix7::Zero();
    Vector7 gradient = Vector7::Zero();
    for (const Triple& triple : triples) {
      const Eigen::Vector3d residual = triple.a * solution - triple.b;
      const double norm = residual.norm() / kVelocitySigma_m_s;
      const double weight = round == 0 || norm <= 1 ? 1 : 1 / norm;
      hessian += weight * triple.a.transpose() * triple.a;
      gradient += weight * triple.a.transpose() * residual;
    }
    const double ratio = kVelocitySigma_m_s / options.accelerometer_bias_sigma_m_s2;
    hessian.diagonal().tail<3>().array() += ratio * ratio;
    gradient.tail<3>() += ratio * ratio * solution.tail<3>();
    if (round == 0) {
      solution -= hessian.ldlt().solve(gradient);
    } else {
      directions.setZero();
      directions(0, 0) = 1;
      directions.block<3, 2>(1, 1) = AxesAcross(solution.segment<3>(1).normalized());
      directions.block<3, 3>(4, 3).setIdentity();
      const Matrix6d reduced = directions.transpose() * hessian * directions;
      solution -= directions * reduced.ldlt().solve(directions.transpose() * gradient);
    }
    const Eigen::Vector3d down = solution.segment<3>(1).normalized();
    solution.segment<3>(1) = options.gravity_m_s2 * down;
  }
  return solution;
}

}  // namespace

std::optional<InertialStart> FindInertialStart(const InertialProblem& problem) {
  InertialStart start;
  FindGyroscopeAndClock(problem, &start);
  const std::vector<PathStep> steps =
      StepsOf(problem, start.clock_offset_s, {start.gyroscope_bias_rad_s, {0, 0, 0}});
  const std::vector<Triple> triples = TriplesOf(problem, steps);
  if (triples.size() < kMinSteps) return std::nullopt;
  const Vector7 solution = SolveLevel(triples, problem.options);
  if (!solution.allFinite()) return std::nullopt;
  start.scale = solution[0];
  start.down = solution.segment<3>(1).normalized();
  start.accelerometer_bias_m_s2 = solution.tail<3>();
  return start;
}

std::vector<InertialState> StatesOf(const InertialProblem& problem, const InertialStart& start) {
  std::vector<InertialState> states;
  const size_t last = problem.size() - 1;
  for (size_t k = 0; k <= last; ++k) {
    const TimedPose &before = problem.path[k == 0 ? 0 : k - 1],
                    &after = problem.path[std::min(k + 1, last)];
    InertialState& state = states.emplace_back();
    state.world_from_imu = problem.WorldFromImu(problem.path[k]);
    state.camera = problem.path[k].world_from_cam.translation();
    state.velocity_m_s =
        (start.scale * (after.world_from_cam.translation() - before.world_from_cam.translation()) -
         (problem.WorldFromImu(after).toRotationMatrix() -
          problem.WorldFromImu(before).toRotationMatrix()) *
             problem.camera_in_imu_m()) /
        SecondsBetween(before.time, after.time);
    state.bias = {start.gyroscope_bias_rad_s, start.accelerometer_bias_m_s2};
    state.log_scale = std::log(start.scale);
    state.down = start.down;
    state.clock_offset_s = start.clock_offset_s;
  }
  return states;
}

}  // namespace deepuav
