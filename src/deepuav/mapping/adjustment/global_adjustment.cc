#include "deepuav/mapping/adjustment/global_adjustment.h"

#include <map>
#include <set>

#include "deepuav/map/all_keyframes.h"
#include "deepuav/mapping/correction.h"

namespace deepuav {
namespace {

void DropOutliers(const BundleReport& report, BundleProblem* problem) {
  std::vector<BundleObservation> kept;
  for (size_t i = 0; i < problem->observations.size(); ++i) {
    if (!report.outlier[i]) kept.push_back(problem->observations[i]);
  }
  problem->observations = std::move(kept);
}

}  // namespace

GlobalAdjustment::GlobalAdjustment(const Map& map, const Pinhole& pinhole,
                                   const BundleOptions& options)
    : map_(map.id()),
      options_(options),
      window_(MakeBundleWindow(map, AllKeyframes(map), pinhole)) {}

void GlobalAdjustment::Compute(const std::function<bool()>& stop) {
  const BundleReport report = AdjustBundle(&window_.problem, options_, stop);
  if (stop && stop()) return;
  const std::vector<BundleObservation> all = window_.problem.observations;
  DropOutliers(report, &window_.problem);
  AdjustBundle(&window_.problem, options_, stop);
  if (stop && stop()) return;  // What is not yet adjusted tells no outliers.
  FindOutliersAmong(all);
}

void GlobalAdjustment::FindOutliersAmong(const std::vector<BundleObservation>& observations) {
  BundleProblem adjusted = window_.problem;
  adjusted.observations = observations;
  const std::vector<double> squared = SquaredErrors(adjusted);
  for (size_t i = 0; i < observations.size(); ++i) {
    if (squared[i] > options_.chi_square) outliers_.push_back(observations[i]);
  }
}

void GlobalAdjustment::Apply(Map* map) const {
  // A keyframe that sees nothing was not moved by the adjustment: it follows its parent.
  std::set<size_t> adjusted;
  for (const BundleObservation& o : window_.problem.observations)
    adjusted.insert(static_cast<size_t>(o.camera));
  std::map<KeyframeId, Sim3> moves;
  for (const size_t k : adjusted) {
    const KeyframeId id = window_.keyframes[k];
    if (!map->Contains(id)) continue;
    const SE3 new_world_from_cam = window_.problem.cam_from_world[k].Inverse();
    moves[id] = Sim3(new_world_from_cam * map->At(id).cam_from_world);
  }
  std::vector<KeyframeMove> keyframe_moves;
  map->keyframes().ForEach([&](const Keyframe& keyframe) {
    KeyframeId known = keyframe.id;
    while (!moves.contains(known) && map->At(known).parent.valid()) known = map->At(known).parent;
    const auto move = moves.find(known);
    if (move != moves.end()) keyframe_moves.push_back({keyframe.id, move->second});
  });
  MoveKeyframes(keyframe_moves, map);
  for (const BundleObservation& outlier : outliers_) {
    const LandmarkId landmark = window_.landmarks[static_cast<size_t>(outlier.landmark)];
    if (map->Contains(landmark))
      map->RemoveObservation(window_.keyframes[static_cast<size_t>(outlier.camera)], landmark);
  }
  for (size_t l = 0; l < window_.landmarks.size(); ++l) {
    if (!map->Contains(window_.landmarks[l])) continue;
    map->SetPosition(window_.landmarks[l], window_.problem.landmarks_world[l]);
    map->UpdateViewRange(window_.landmarks[l]);
  }
  map->CountMove();
}

}  // namespace deepuav
