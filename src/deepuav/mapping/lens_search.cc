#include "deepuav/mapping/lens_search.h"

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
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

void LensSearchOptions::Check() const { CheckOptions("mapping.lens", *this); }

std::optional<FoundLens> FindLens(const Map& map, const Pinhole& pinhole,
                                  const BundleOptions& bundle, const LensSearchOptions& options,
                                  const std::function<bool()>& stop) {
  if (map.KeyframeCount() < options.min_keyframes) return std::nullopt;
  BundleProblem problem = MakeBundleWindow(map, AllKeyframes(map), pinhole).problem;
  // The map was adjusted otherwise, to errors as they show themselves: that is nothing to compare.
  const double known_cost = AdjustBundle(&problem, bundle, stop).final_cost;
  const BundleOptions freed = FreeingTheLens(bundle, options);
  const double freed_cost = AdjustBundle(&problem, freed, stop).final_cost;
  if ((stop && stop()) || !(known_cost > 0)) return std::nullopt;
  FoundLens found;
  found.camera = {problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, 0};
  found.cost_share = 1 - freed_cost / known_cost;
  Log().debug("k1 {:.4f} and k2 {:.4f} save {:.2f} % of the errors of map {}", problem.k1,
              problem.k2, 100 * found.cost_share, map.id().value);
  if (found.cost_share < options.min_cost_share) return std::nullopt;
  const auto sigmas = EstimateCalibrationSigmas(problem, freed);
  if (!sigmas) return std::nullopt;
  found.sigmas = *sigmas;
  return found;
}

}  // namespace deepuav
