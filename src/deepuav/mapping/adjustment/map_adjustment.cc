#include "deepuav/mapping/adjustment/map_adjustment.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/adjustment/bundle_window.h"
#include "deepuav/mapping/adjustment/map_factors.h"

namespace deepuav {
namespace {

std::vector<LandmarkId> Without(const std::set<LandmarkId>& left_out,
                                const std::vector<LandmarkId>& landmarks) {
  std::vector<LandmarkId> kept;
  std::set_difference(landmarks.begin(), landmarks.end(), left_out.begin(), left_out.end(),
                      std::back_inserter(kept));
  return kept;
}

/// By the poses as they are.
void Place(const std::set<LandmarkId>& landmarks, const Pinhole& pinhole,
           const BundleOptions& options, Map* map) {
  std::vector<LandmarkId> remaining;
  for (const LandmarkId id : landmarks) {
    if (map->Contains(id)) remaining.push_back(id);
  }
  if (remaining.empty()) return;
  BundleWindow window = MakeBundleWindow(*map, {}, std::move(remaining), pinhole);
  const BundleReport report = AdjustBundle(&window.problem, options);
  WriteBack(window, map);
  RemoveOutliers(report, window, map);
}

BundleReport AdjustTwice(Map* map, const std::vector<KeyframeId>& free, Pinhole* pinhole,
                         const BundleOptions& options, const MapTrust& trust,
                         const std::function<bool()>& stop, const MapFactors* factors) {
  const std::set<LandmarkId> hovering = HoveringLandmarks(*map, free, trust.hovering);
  const double focal_guess_px = pinhole->fx;
  BundleReport report;
  for (int run = 0; run < 2; ++run) {
    BundleWindow window =
        MakeBundleWindow(*map, free, Without(hovering, LandmarksSeenBy(*map, free)), *pinhole);
    window.problem.focal_guess_px = focal_guess_px;
    if (factors) AddFactors(*factors, &window);
    report = run == 0 ? AdjustBundle(&window.problem, options, stop)
                      : AdjustReweighed(&window.problem, options, trust.reweighing, stop);
    *pinhole = window.problem.pinhole;
    WriteBack(window, map);
    if (stop && stop()) break;  // What is not yet adjusted tells no outliers.
    RemoveOutliers(report, window, map);
  }
  if (!(stop && stop())) Place(hovering, *pinhole, options, map);
  for (const LandmarkId id : LandmarksSeenBy(*map, free)) map->UpdateViewRange(id);
  return report;
}

}  // namespace

MapTrust TrustInAll() { return {{.distrust = false}, {.rounds = 0}}; }

BundleReport AdjustWindow(Map* map, const std::vector<KeyframeId>& free, const Pinhole& pinhole,
                          const BundleOptions& options, const MapTrust& trust,
                          const std::function<bool()>& stop) {
  Pinhole unchanged = pinhole;
  return AdjustTwice(map, free, &unchanged, options, trust, stop, nullptr);
}

BundleReport AdjustMap(Map* map, Pinhole* pinhole, const BundleOptions& options,
                       const MapTrust& trust, const std::function<bool()>& stop,
                       const MapFactors* factors) {
  return AdjustTwice(map, AllKeyframes(*map), pinhole, options, trust, stop, factors);
}

}  // namespace deepuav
