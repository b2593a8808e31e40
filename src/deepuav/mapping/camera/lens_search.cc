#include "deepuav/mapping/camera/lens_search.h"

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/adjustment/bundle_window.h"

namespace deepuav {
namespace {

/// How far a pixel of the image moves with one of the undistorted camera; nothing where the lens
/// does not reach.
std::optional<Eigen::Matrix2d> DistortJacobian(const Camera& camera, const Eigen::Vector2d& px) {
  constexpr double kStepPx = 0.5;
  Eigen::Matrix2d jacobian;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kStepPx * Eigen::Vector2d::Unit(axis);
    const auto after = camera.Distort(camera.pinhole.Unproject(px + step));
    const auto before = camera.Distort(camera.pinhole.Unproject(px - step));
    if (!after || !before) return std::nullopt;
    jacobian.col(axis) = (*after - *before) / (2 * kStepPx);
  }
  return jacobian;
}

/// What was observed in the undistorted camera as it lies in the images; what these do not show is
/// left out.
void SeeAsTaken(const Camera& camera, BundleProblem* problem) {
  if (camera.lens == LensModel::kRadialTangential) {
    problem->k1 = camera.distortion[0];
    problem->k2 = camera.distortion[1];
    problem->p1 = camera.distortion[2];
    problem->p2 = camera.distortion[3];
  }
  std::erase_if(problem->observations, [&](BundleObservation& observation) {
    const auto image_px = camera.Distort(camera.pinhole.Unproject(observation.px));
    const auto jacobian = DistortJacobian(camera, observation.px);
    if (!image_px || !jacobian) return true;
    observation.px = *image_px;
    observation.noise = PixelNoise(
        Eigen::Matrix2d(*jacobian * observation.noise.Covariance() * jacobian->transpose()));
    return !observation.noise.usable();
  });
}

/// What the priors of focal length and principal point are about.
void HoldTo(const Pinhole& told, BundleProblem* problem) {
  problem->focal_guess_px = told.fx;
  problem->centre_guess_px = Eigen::Vector2d(told.cx, told.cy);
}

/// Adjusts as known, then with the lens free.
std::optional<FoundLens> Search(const BundleOptions& known, const BundleOptions& freed,
                                const LensSearchOptions& options, const std::function<bool()>& stop,
                                BundleWindow window) {
  BundleProblem& problem = window.problem;
  const double focal_px = problem.pinhole.fx;
  // The map was adjusted otherwise, to errors as they show themselves: that is nothing to compare.
  const double known_cost = AdjustBundle(&problem, known, stop).final_cost;
  const double freed_cost = AdjustBundle(&problem, freed, stop).final_cost;
  if ((stop && stop()) || !(known_cost > 0)) return std::nullopt;
  FoundLens found;
  found.camera = {problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, 0};
  found.cost_share = 1 - freed_cost / known_cost;
  Log().debug("k1 {:.4f}, k2 {:.4f}, focal length {:+.3f} % save {:.2f} % of a map's errors",
              problem.k1, problem.k2, 100 * (problem.pinhole.fx / focal_px - 1),
              100 * found.cost_share);
  if (found.cost_share < options.min_cost_share) return std::nullopt;
  const auto sigmas = EstimateCalibrationSigmas(problem, freed);
  if (!sigmas) return std::nullopt;
  found.sigmas = *sigmas;
  found.adjusted = std::move(window);
  return found;
}

}  // namespace

void LensSearchOptions::Check() const { CheckOptions("mapping.lens", *this); }

BundleOptions FreeingTheLens(BundleOptions bundle, const LensSearchOptions& options) {
  bundle.refine_radial = true;
  bundle.k1_sigma = bundle.k2_sigma = options.radial_sigma;
  bundle.refine_focal = bundle.refine_centre = bundle.refine_tangential = options.whole;
  bundle.focal_sigma = options.focal_sigma;
  bundle.centre_sigma = options.centre_sigma;
  bundle.tangential_sigma = options.tangential_sigma;
  return bundle;
}

bool IsWhollySearchable(const Camera& camera) {
  constexpr size_t kWithoutThirdRadial = 4;
  return camera.lens == LensModel::kPinhole || (camera.lens == LensModel::kRadialTangential &&
                                                camera.distortion.size() == kWithoutThirdRadial);
}

std::optional<FoundLens> FindWholeLens(const Map& map, const Camera& camera, const Pinhole& told,
                                       const BundleOptions& bundle,
                                       const LensSearchOptions& options,
                                       const std::function<bool()>& stop) {
  if (map.KeyframeCount() < options.min_keyframes) return std::nullopt;
  BundleWindow window = MakeBundleWindow(map, AllKeyframes(map), camera.pinhole);
  BundleProblem& problem = window.problem;
  SeeAsTaken(camera, &problem);
  HoldTo(told, &problem);
  BundleOptions freed = FreeingTheLens(bundle, options);
  freed.refine_focal = freed.refine_centre = freed.refine_tangential = true;
  // These are about none, not about the calibration's.
  const BundleOptions none;
  freed.k1_sigma = none.k1_sigma;
  freed.k2_sigma = none.k2_sigma;
  return Search(bundle, freed, options, stop, std::move(window));
}

std::optional<FoundLens> FindLens(const Map& map, const Pinhole& pinhole,
                                  const BundleOptions& bundle, const LensSearchOptions& options,
                                  const std::function<bool()>& stop) {
  if (map.KeyframeCount() < options.min_keyframes) return std::nullopt;
  BundleWindow window = MakeBundleWindow(map, AllKeyframes(map), pinhole);
  HoldTo(pinhole, &window.problem);
  return Search(bundle, FreeingTheLens(bundle, options), options, stop, std::move(window));
}

}  // namespace deepuav
