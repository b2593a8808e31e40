#include "deepuav/estimation/bundle/bundle_adjustment.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <utility>

#include "deepuav/base/option_check.h"
#include "deepuav/estimation/bundle/bundle_linearisation.h"
#include "deepuav/estimation/bundle/reduced_camera_system.h"
#include "deepuav/estimation/solvers/levenberg_damping.h"

namespace deepuav {
namespace {

constexpr double kMinDamping = 1e-12;
constexpr double kMaxDamping = 1e12;

/// The share of its depth that a landmark keeps at least in a step, and how often its step is
/// halved for that.
constexpr double kMinDepthRatio = 0.1;
constexpr int kMaxHalvings = 4;

/// Whether a landmark that was in front of a camera would be left with less than kMinDepthRatio of
/// its depth there.
bool FallsThroughCamera(const BundleStructure& structure, const BundleState& state,
                        const BundleState& moved, int group) {
  const int landmark = structure.landmark_of_group[group];
  for (int i = structure.group_begin[group]; i < structure.group_begin[group + 1]; ++i) {
    const int camera = structure.observations[i].camera;
    const double before = (state.cam_from_world[camera] * state.landmarks_world[landmark]).z();
    const double after = (moved.cam_from_world[camera] * moved.landmarks_world[landmark]).z();
    if (before > kMinDepth && after < kMinDepthRatio * before) return true;
  }
  return false;
}

/// A landmark whose depth is nearly unknown may get a step that leads behind a camera. Were the
/// whole step refused for it, a few wrong matches could stop the adjustment: its own step is
/// shortened instead.
void Move(const BundleStructure& structure, const BundleState& state, const BundleStep& step,
          BundleState* moved) {
  moved->camera = state.camera.Moved(step.calibration);
  for (int i = 0; i < structure.free_cameras(); ++i) {
    const int camera = structure.camera_of_free[i];
    moved->cam_from_world[camera] = SE3::Exp(step.camera[i]) * state.cam_from_world[camera];
  }
  for (int group = 0; group < structure.groups(); ++group) {
    const int landmark = structure.landmark_of_group[group];
    const Eigen::Vector3d& before = state.landmarks_world[landmark];
    Eigen::Vector3d& after = moved->landmarks_world[landmark];
    after = before + step.landmark[group];
    for (int i = 0; i < kMaxHalvings && FallsThroughCamera(structure, state, *moved, group); ++i) {
      after = 0.5 * (before + after);
    }
  }
}

RefinedCalibration RefinedOf(const BundleOptions& options) {
  return {options.refine_focal, options.refine_radial, options.refine_centre,
          options.refine_tangential, options.refine_readout};
}

void Minimise(const BundleStructure& structure, const BundleOptions& options,
              const std::function<bool()>& stop, BundleState* state, BundleReport* report) {
  const HuberLoss loss{options.chi_square};
  const RefinedCalibration refined = RefinedOf(options);
  report->initial_cost = report->final_cost = BundleCost(structure, *state, loss, options.threads);
  if (structure.groups() == 0) {
    report->converged = true;
    return;
  }
  ReducedCameraSystem system(structure, ReducedCameraSystem::kSparseCameras, options.threads);
  BundleLinearisation linearisation;
  BundleStep step;
  BundleState candidate = *state;
  LevenbergDamping damping(options.initial_damping, kMinDamping, kMaxDamping);
  bool linearised = false;
  while (report->iterations < options.max_iterations && !report->converged &&
         !damping.Exhausted()) {
    if (stop && stop()) return;
    ++report->iterations;
    if (!linearised) linearisation.Compute(structure, *state, loss, refined, options.threads);
    linearised = true;
    if (!system.Solve(linearisation, damping.value(), &step)) {
      damping.Reject();
      continue;
    }
    Move(structure, *state, step, &candidate);
    const double cost = BundleCost(structure, candidate, loss, options.threads);
    const double decrease = report->final_cost - cost;
    const double enough = options.min_relative_decrease * report->final_cost;
    const bool is_last = step.camera_decrease <= options.max_last_move;
    if (!(decrease >= 0)) {  // Also where the cost is not a number.
      damping.Reject();
      report->converged = is_last && step.predicted_decrease <= enough;
      continue;
    }
    report->converged = is_last && decrease <= enough;
    damping.Accept(step.predicted_decrease > 0 ? decrease / step.predicted_decrease : 1);
    std::swap(*state, candidate);
    report->final_cost = cost;
    linearised = false;
  }
}

FocalPrior FocalPriorOf(const BundleProblem& problem, const BundleOptions& options) {
  const double guess = problem.focal_guess_px > 0 ? problem.focal_guess_px : problem.pinhole.fx;
  return {guess, 1 / options.focal_sigma};
}

BundleStructure StructureOf(const BundleProblem& problem, const BundleOptions& options) {
  BundleStructure structure(problem);
  if (options.refine_focal) structure.focal_prior = FocalPriorOf(problem, options);
  SmallPrior& small = structure.small_prior;
  if (options.refine_radial) {
    small.radial_guess = problem.radial_guess;
    small.per_k1_sigma = 1 / options.k1_sigma;
    small.per_k2_sigma = 1 / options.k2_sigma;
  }
  if (options.refine_centre) {
    const Pinhole& pinhole = problem.pinhole;
    structure.centre_prior = {
        problem.centre_guess_px.value_or(Eigen::Vector2d(pinhole.cx, pinhole.cy)),
        1 / (options.centre_sigma * pinhole.fx)};
  }
  if (options.refine_tangential) small.per_tangential_sigma = 1 / options.tangential_sigma;
  if (options.refine_readout) small.per_readout_sigma_s = 1 / options.readout_sigma_s;
  return structure;
}

BundleState StateOf(const BundleProblem& problem) {
  return {{problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, problem.readout_s},
          problem.cam_from_world,
          problem.landmarks_world};
}

/// In standard deviations; infinite where there is no error to speak of.
double SquaredError(const BundleObservation& observation, const BundleState& state) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  if (!UsableObservation(observation)) return kNone;
  const Eigen::Vector3d point =
      state.cam_from_world[observation.camera] * state.landmarks_world[observation.landmark] +
      state.camera.readout_s * observation.drift_cam_per_s;
  if (!InFrontOfCamera(point)) return kNone;
  const Eigen::Vector2d error_px = state.camera.Project(point) - observation.px;
  return (Whitening(observation.noise) * error_px).squaredNorm();
}

bool IsOutlier(double squared_error, double chi_square) { return !(squared_error <= chi_square); }

constexpr double kHoldsTheGauge = 1e-9;

/// As little more as the numbers ask for: landmarks without parallax, as those that a hover saw,
/// leave hardly a system at all.
bool SolveHoldingTheGauge(const BundleLinearisation& linearisation, ReducedCameraSystem* system,
                          BundleStep* step) {
  constexpr double kMostDamping = 1e-5;
  for (double damping = kHoldsTheGauge; damping <= kMostDamping; damping *= 10) {
    if (system->Solve(linearisation, damping, step)) return true;
  }
  return false;
}

/// Of the inliers' errors, over what is stated of them; nothing where nothing is left to tell it.
std::optional<double> NoiseVariance(const BundleProblem& problem, const BundleStructure& structure,
                                    const BundleState& state, const BundleOptions& options) {
  double squared = 0, count = 0;
  for (const BundleObservation& observation : problem.observations) {
    const double error = SquaredError(observation, state);
    if (IsOutlier(error, options.chi_square)) continue;
    squared += error;
    count += 2;
  }
  const double freedom = count - 6.0 * structure.free_cameras() - 3.0 * structure.groups();
  if (freedom < 1) return std::nullopt;
  return squared / freedom;
}

}  // namespace

void BundleOptions::Check() const { CheckOptions("", *this); }

BundleReport AdjustBundle(BundleProblem* problem, const BundleOptions& options,
                          const std::function<bool()>& stop) {
  options.Check();
  CheckBundleProblem(*problem);
  const BundleStructure structure = StructureOf(*problem, options);
  BundleState state = StateOf(*problem);
  BundleReport report;
  Minimise(structure, options, stop, &state, &report);

  report.outlier.reserve(problem->observations.size());
  for (const BundleObservation& observation : problem->observations) {
    report.outlier.push_back(IsOutlier(SquaredError(observation, state), options.chi_square));
  }
  problem->pinhole = state.camera.pinhole;
  problem->k1 = state.camera.k1;
  problem->k2 = state.camera.k2;
  problem->p1 = state.camera.p1;
  problem->p2 = state.camera.p2;
  problem->readout_s = state.camera.readout_s;
  problem->cam_from_world = std::move(state.cam_from_world);
  problem->landmarks_world = std::move(state.landmarks_world);
  return report;
}

std::vector<double> SquaredErrors(const BundleProblem& problem) {
  const BundleState state = StateOf(problem);
  std::vector<double> errors;
  errors.reserve(problem.observations.size());
  for (const BundleObservation& observation : problem.observations)
    errors.push_back(SquaredError(observation, state));
  return errors;
}

std::optional<CalibrationSigmas> EstimateCalibrationSigmas(const BundleProblem& problem,
                                                           const BundleOptions& options) {
  options.Check();
  CheckBundleProblem(problem);
  const BundleStructure structure = StructureOf(problem, options);
  const BundleState state = StateOf(problem);
  const RefinedCalibration refined = RefinedOf(options);
  if (!refined.any() || structure.groups() == 0) return std::nullopt;
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, HuberLoss{options.chi_square}, refined);
  // What is not refined has no information of its own.
  for (int parameter = 0; parameter < kCalibrationParameters; ++parameter) {
    if (!refined.Has(parameter)) linearisation.calibration_calibration(parameter, parameter) = 1;
  }
  ReducedCameraSystem system(structure);
  BundleStep step;
  if (!SolveHoldingTheGauge(linearisation, &system, &step)) return std::nullopt;

  const std::optional<double> variance = NoiseVariance(problem, structure, state, options);
  if (!variance) return std::nullopt;
  const MatrixCalibration covariance = *variance * system.CalibrationInformation().inverse();
  const Eigen::Array<double, kCalibrationParameters, 1> sigmas =
      covariance.diagonal().array().sqrt();
  if (!sigmas.allFinite()) return std::nullopt;
  const auto sigma = [&](int parameter) { return refined.Has(parameter) ? sigmas[parameter] : 0; };
  return CalibrationSigmas{.focal = sigma(kFocalScale),
                           .k1 = sigma(kRadial1),
                           .k2 = sigma(kRadial2),
                           .centre = std::max(sigma(kCentreX), sigma(kCentreY)),
                           .tangential = std::max(sigma(kTangential1), sigma(kTangential2)),
                           .readout_s = sigma(kReadout)};
}

std::optional<std::vector<Matrix6d>> EstimateCameraCovariances(const BundleProblem& problem,
                                                               const BundleOptions& options) {
  options.Check();
  CheckBundleProblem(problem);
  const BundleState state = StateOf(problem);
  const auto variance = NoiseVariance(problem, StructureOf(problem, options), state, options);
  if (!variance) return std::nullopt;
  BundleProblem of_shown_noise = problem;  // That of the pixels: other sensors' is as they state.
  for (BundleObservation& o : of_shown_noise.observations)
    o.noise = PixelNoise(*variance * o.noise.Covariance());
  const BundleStructure structure = StructureOf(of_shown_noise, options);
  BundleLinearisation linearisation;
  linearisation.Compute(structure, state, HuberLoss{options.chi_square}, RefinedCalibration{});
  ReducedCameraSystem system(structure);
  BundleStep step;
  if (!system.Solve(linearisation, kHoldsTheGauge, &step)) return std::nullopt;
  std::vector<Matrix6d> covariances(problem.cam_from_world.size(), Matrix6d::Zero());
  const std::vector<Matrix6d> of_free = system.CameraCovariances();
  for (int i = 0; i < structure.free_cameras(); ++i) {
    const auto camera = static_cast<size_t>(structure.camera_of_free[i]);
    covariances[camera] = of_free[static_cast<size_t>(i)];
    if (!covariances[camera].allFinite()) return std::nullopt;
  }
  return covariances;
}

}  // namespace deepuav
