#include "deepuav/mapping/lens_search.h"

#include "deepuav/base/logging.h"
#include "deepuav/base/option_bounds.h"
#include "deepuav/base/options.h"
#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/bundle_window.h"

namespace deepuav {
namespace {

BundleOptions FreeingTheLens(BundleOptions bundle, const LensSearchOptions& options) {
  bundle.refine_radial = true;
  bundle.k1_sigma = bundle.k2_sigma = options.radial_sigma;
  return bundle;
}

}  // namespace

void LensSearchOptions::Check() const {
  CheckPositive("radial_sigma", radial_sigma, 100);
  CheckRange("min_keyframes", min_keyframes, 2, 1'000'000);
  CheckOption(min_cost_share >= 0 && min_cost_share <= 1, "min_cost_share", min_cost_share,
              "0 to 1");
  CheckPositive("max_error_px", max_error_px, 100);
  CheckRange("max_rounds", max_rounds, 1, 100);
}

std::optional<FoundLens> FindLens(const Map& map, const Pinhole& pinhole,
                                  const BundleOptions& bundle, const LensSearchOptions& options,
                                  const std::function<bool()>& stop) {
  if (map.KeyframeCount() < options.min_keyframes) return std::nullopt;
  BundleProblem problem = MakeBundleWindow(map, AllKeyframes(map), pinhole).problem;
  const BundleOptions freed = FreeingTheLens(bundle, options);
  const BundleReport report = AdjustBundle(&problem, freed, stop);
  if ((stop && stop()) || !(report.initial_cost > 0)) return std::nullopt;
  FoundLens found;
  found.camera = {problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, 0};
  found.cost_share = 1 - report.final_cost / report.initial_cost;
  Log().debug("k1 {:.4f} and k2 {:.4f} save {:.2f} % of the errors of map {}", problem.k1,
              problem.k2, 100 * found.cost_share, map.id().value);
  if (found.cost_share < options.min_cost_share) return std::nullopt;
  const auto sigmas = EstimateCalibrationSigmas(problem, freed);
  if (!sigmas) return std::nullopt;
  found.sigmas = *sigmas;
  return found;
}

}  // namespace deepuav
