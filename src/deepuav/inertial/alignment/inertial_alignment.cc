#include "deepuav/inertial/alignment/inertial_alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/inertial/alignment/inertial_start.h"
#include "deepuav/inertial/alignment/mount_search.h"
#include "deepuav/inertial/chain/inertial_adjustment.h"
#include "deepuav/inertial/paths/path_noise.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
/// The noise of the path is estimated between the rounds.
constexpr int kRounds = 4, kIterations = 40;
/// Of the path, until it is estimated.
constexpr double kFirstTurnSigma_rad = 0.1 * kDegree, kFirstPositionSigma_m = 0.02;
/// Share of the camera's axis along the vertical from which it has no heading of its own.
constexpr double kSteep = 0.9;

/// The poses by growing time where samples are about, at most one in an interval.
Trajectory PosesWithSamples(const Trajectory& path, const ImuIntegrator& imu,
                            const InertialOptions& options) {
  Trajectory sorted = path, kept;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const TimedPose& a, const TimedPose& b) { return a.time < b.time; });
  for (const TimedPose& pose : sorted) {
    if (!imu.At(pose.time)) continue;
    const bool is_near = !kept.empty() && (pose.time == kept.back().time ||
                                           SecondsBetween(kept.back().time, pose.time) <
                                               options.min_pose_interval_s);
    if (!is_near) kept.push_back(pose);
  }
  return kept;
}

double LinkedSeconds(const InertialProblem& problem) {
  double seconds = 0;
  for (size_t k = 0; k < problem.linked.size(); ++k) {
    if (problem.linked[k])
      seconds += SecondsBetween(problem.path[k].time, problem.path[k + 1].time);
  }
  return seconds;
}

/// Weights of the local scales in the scale of the similarity that takes the path nearest to the
/// metric one.
std::vector<double> ScaleWeights(const Trajectory& path) {
  const size_t count = path.size();
  const double share = 1 / static_cast<double>(count);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), beyond = mean;
  for (const TimedPose& pose : path) mean += share * pose.world_from_cam.translation();
  std::vector<double> weights(count, 0);
  double sum = 0;
  for (size_t k = count - 1; k > 0; --k) {
    const Eigen::Vector3d here = path[k].world_from_cam.translation();
    beyond += here - mean;
    weights[k - 1] = beyond.dot(here - path[k - 1].world_from_cam.translation());
    sum += weights[k - 1];
  }
  for (double& weight : weights) weight = sum > 0 ? weight / sum : share;
  return weights;
}

std::vector<MotionState> MotionsIn(const Sim3& level_from_world, const InertialProblem& problem,
                                   const std::vector<InertialState>& states) {
  std::vector<MotionState> motions;
  motions.reserve(states.size());
  for (size_t k = 0; k < states.size(); ++k) {
    const InertialState& state = states[k];
    const Eigen::Quaterniond level_from_imu = level_from_world.rotation() * state.world_from_imu;
    const Eigen::Vector3d sensor =
        level_from_world * state.camera - level_from_imu * problem.camera_in_imu_m();
    motions.push_back({problem.path[k].time,
                       {level_from_imu, sensor},
                       level_from_world.rotation() * state.velocity_m_s,
                       state.bias});
  }
  return motions;
}

InertialAlignment Summarise(const InertialProblem& problem, const TimedPose& first,
                            const std::vector<InertialState>& states,
                            const std::vector<double>& weights) {
  InertialAlignment found;
  const double share = 1 / static_cast<double>(states.size());
  double log_scale = 0, turn_variance = 0, position_variance = 0, spread_variance = 0;
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  const std::vector<Vector6d> residuals = PathResiduals(problem, states);
  for (size_t k = 0; k < states.size(); ++k) {
    log_scale += weights[k] * states[k].log_scale;
    down += states[k].down;
    found.clock_offset_s += share * states[k].clock_offset_s;
    found.bias.gyroscope_rad_s += share * states[k].bias.gyroscope_rad_s;
    found.bias.accelerometer_m_s2 += share * states[k].bias.accelerometer_m_s2;
    turn_variance += share / 3 * residuals[k].head<3>().squaredNorm();
    position_variance += share / 3 * residuals[k].tail<3>().squaredNorm();
  }
  for (const InertialState& state : states)
    spread_variance += share * std::pow(state.log_scale - log_scale, 2);
  const double scale = std::exp(log_scale);
  found.scale_spread = std::sqrt(spread_variance);
  found.turn_residual_rad = std::sqrt(turn_variance);
  found.position_residual_m = scale * std::sqrt(position_variance);
  found.duration_s = LinkedSeconds(problem);
  found.cam_from_imu = problem.cam_from_imu;
  found.level_from_world = LevelByFirstCamera(first.world_from_cam, -down.normalized(), scale);
  found.motions = MotionsIn(found.level_from_world, problem, states);
  return found;
}

/// Why it is not to be believed; empty where it is.
std::string Doubt(const InertialAlignment& found, const InertialOptions& options) {
  if (const double turn_deg = found.turn_residual_rad / kDegree;
      !(turn_deg <= options.max_turn_residual_deg)) {
    return fmt::format("the gyroscope misses the camera's turns by {:.2f} degrees", turn_deg);
  }
  if (!(found.chi_square <= options.max_chi_square)) {
    return fmt::format("the samples miss the camera's path by {:.1f} times their noise",
                       std::sqrt(found.chi_square));
  }
  if (const double bias = found.bias.gyroscope_rad_s.norm();
      !(bias <= options.max_gyroscope_bias_rad_s)) {
    return fmt::format("the gyroscope would be off by {:.2f} rad/s", bias);
  }
  if (const double bias = found.bias.accelerometer_m_s2.norm();
      !(bias <= options.max_accelerometer_bias_m_s2)) {
    return fmt::format("the accelerometer would be off by {:.2f} m/s^2", bias);
  }
  if (!(found.scale_sigma <= options.max_scale_sigma)) {
    return fmt::format("the flight leaves the scale open by {:.1f} %", 100 * found.scale_sigma);
  }
  if (const double tilt_deg = found.tilt_sigma_rad / kDegree;
      !(tilt_deg <= options.max_tilt_sigma_deg)) {
    return fmt::format("the flight leaves what is level open by {:.1f} degrees", tilt_deg);
  }
  return "";
}

/// The standard deviations, with errors of poses that are alike.
bool FindSigmas(InertialProblem problem, const std::vector<InertialState>& states,
                const std::vector<double>& weights, double mount_sigma_rad,
                InertialAlignment* found) {
  const double inflation = std::sqrt(VarianceInflation(PathResiduals(problem, states), problem));
  for (double& sigma : problem.position_sigma) sigma *= inflation;
  const auto covariance = CovarianceOf(problem, states, weights);
  if (!covariance) return false;
  found->scale_sigma = std::hypot(covariance->log_scale_sigma, problem.options.path_scale_sigma);
  found->mount_sigma_rad = mount_sigma_rad;
  found->tilt_sigma_rad = std::hypot(covariance->down_sigma_rad, mount_sigma_rad);
  found->clock_sigma_s = covariance->clock_sigma_s;
  return true;
}

InertialAttempt Refused(std::string reason) { return {std::nullopt, std::move(reason)}; }

InertialAttempt Align(const TimedPose& first, InertialProblem problem, double mount_sigma_rad,
                      const std::function<bool()>& stop) {
  const InertialOptions& options = problem.options;
  const std::optional<InertialStart> start = FindInertialStart(problem);
  if (!start) return Refused("the path has too few steps with samples");
  if (!(start->scale > 0)) return Refused("the accelerometer does not fit the camera's path");
  problem.turn_sigma_rad.assign(problem.size(), kFirstTurnSigma_rad);
  problem.position_sigma.assign(problem.size(), kFirstPositionSigma_m / start->scale);
  std::vector<InertialState> states = StatesOf(problem, *start);
  InertialFit fit = AdjustInertial(problem, kIterations, &states);
  for (int round = 1; round < kRounds; ++round) {
    if (stop && stop()) return Refused("the run was stopped");
    EstimatePathNoise(PathResiduals(problem, states), &problem);
    fit = AdjustInertial(problem, kIterations, &states);
  }
  const std::vector<double> weights = ScaleWeights(problem.path);
  InertialAlignment found = Summarise(problem, first, states, weights);
  found.chi_square = fit.imu_chi_square;
  if (!FindSigmas(problem, states, weights, mount_sigma_rad, &found))
    return Refused("the flight leaves scale and level open");
  if (std::string doubt = Doubt(found, options); !doubt.empty()) return Refused(std::move(doubt));
  if (!fit.converged) return Refused("the samples do not fit the camera's path");
  return {found, ""};
}

}  // namespace

Sim3 LevelByFirstCamera(const SE3& first_world_from_cam, const Eigen::Vector3d& up_world,
                        double scale) {
  const Eigen::Matrix3d axes = first_world_from_cam.RotationMatrix();
  const Eigen::Vector3d ahead = axes.col(2), upper_edge = -axes.col(1);
  const Eigen::Vector3d forward = std::abs(ahead.dot(up_world)) < kSteep ? ahead : upper_edge;
  const Eigen::Vector3d x = (forward - forward.dot(up_world) * up_world).normalized();
  Eigen::Matrix3d level_from_world;
  level_from_world.row(0) = x;
  level_from_world.row(1) = up_world.cross(x);
  level_from_world.row(2) = up_world;
  const Eigen::Quaterniond rotation(level_from_world);
  return {scale, rotation, -scale * (rotation * first_world_from_cam.translation())};
}

InertialAttempt AlignInertially(const Trajectory& path, const ImuStream& imu,
                                const InertialOptions& options, const std::function<bool()>& stop) {
  const ImuIntegrator integrator(CleanSamples(imu.samples), NoiseOf(imu, options),
                                 options.max_imu_gap_s);
  InertialProblem problem;
  problem.imu = &integrator;
  problem.cam_from_imu = imu.cam_from_imu;
  problem.path = WithoutJumps(PosesWithSamples(path, integrator, options));
  problem.options = options;
  if (problem.size() >= 2) problem.LinkStates();
  const double seconds = LinkedSeconds(problem);
  if (seconds < options.min_duration_s) {
    return Refused(fmt::format("{:.1f} s of the path have samples: expected {:g} s", seconds,
                               options.min_duration_s));
  }
  problem.options.path_scale_sigma =
      std::hypot(options.path_scale_sigma, imu.mount_is_known ? options.sensor_scale_sigma
                                                              : options.uncalibrated_scale_sigma);
  double mount_sigma_rad = 0;
  if (!imu.mount_is_known) {
    const std::optional<FoundMount> mount = FindMount(problem.path, integrator, options);
    if (!mount) return Refused("the camera's turns do not tell how the sensor is mounted");
    problem.cam_from_imu = {mount->cam_from_imu, imu.cam_from_imu.translation()};
    mount_sigma_rad = mount->sigma_rad;
  }
  const auto first =
      std::min_element(path.begin(), path.end(),
                       [](const TimedPose& a, const TimedPose& b) { return a.time < b.time; });
  return Align(*first, std::move(problem), mount_sigma_rad, stop);
}

}  // namespace deepuav
