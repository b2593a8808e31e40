#include "deepuav/mapping/landmarks/fusion.h"

#include <algorithm>
#include <set>

#include "deepuav/base/option_check.h"
#include "deepuav/features/keypoint_grid.h"

namespace deepuav {
namespace {

std::vector<KeyframeId> NeighboursAndTheirs(const Map& map, KeyframeId id,
                                            const FusionOptions& options) {
  std::vector<KeyframeId> neighbours = map.Covisible(id, 1, options.max_neighbours);
  std::set<KeyframeId> taken(neighbours.begin(), neighbours.end());
  taken.insert(id);
  const size_t first_ring = neighbours.size();
  const size_t most = 2 * static_cast<size_t>(options.max_neighbours);
  for (size_t i = 0; i < first_ring && neighbours.size() < most; ++i) {
    for (KeyframeId second : map.Covisible(neighbours[i], 1, options.second_ring)) {
      if (taken.insert(second).second) neighbours.push_back(second);
    }
  }
  return neighbours;
}

/// Looks for `landmarks` in the keyframe; adds those that gained observations to `changed`.
void FuseInto(Map* map, KeyframeId id, const std::vector<LandmarkId>& landmarks,
              const Camera& camera, const FusionOptions& options, const PatchObserver& observer,
              std::set<LandmarkId>* changed) {
  const Keyframe& keyframe = map->At(id);
  std::vector<ProjectionTarget> targets;
  std::vector<LandmarkId> sought;
  Descriptors descriptors(keyframe.features().descriptors.dimension());
  const std::set<LandmarkId> present(keyframe.landmarks.begin(), keyframe.landmarks.end());
  for (LandmarkId landmark_id : landmarks) {
    if (!map->Contains(landmark_id) || present.contains(landmark_id)) continue;
    const Landmark& landmark = map->At(landmark_id);
    const auto px = ExpectedPixel(landmark, keyframe.cam_from_world, camera, options.visibility);
    if (!px) continue;
    targets.push_back({*px, options.radius_px, static_cast<int>(sought.size())});
    sought.push_back(landmark_id);
    descriptors.AppendFrom(map->At(landmark.representative.keyframe).features().descriptors,
                           landmark.representative.keypoint);
  }
  const KeypointGrid grid(keyframe.features());
  for (const Match& match :
       MatchProjected(targets, descriptors, keyframe.features(), grid, options.projection)) {
    const LandmarkId wanted = sought[static_cast<size_t>(match.a)];
    const LandmarkId there = keyframe.landmarks[static_cast<size_t>(match.b)];
    if (!there.valid()) {
      observer.AddObservation(map, id, match.b, wanted);
      changed->insert(wanted);
      continue;
    }
    const bool keep_there =
        map->At(there).observations.size() >= map->At(wanted).observations.size();
    observer.Merge(map, keep_there ? wanted : there, keep_there ? there : wanted);
    changed->insert(keep_there ? there : wanted);
  }
}

std::vector<LandmarkId> ValidLandmarks(const Keyframe& keyframe) {
  std::vector<LandmarkId> landmarks;
  for (LandmarkId id : keyframe.landmarks) {
    if (id.valid()) landmarks.push_back(id);
  }
  std::sort(landmarks.begin(), landmarks.end());
  return landmarks;
}

}  // namespace

void FusionOptions::Check() const { CheckOptions("mapping.fusion", *this); }

void FuseDuplicates(Map* map, KeyframeId id, const Camera& camera, const FusionOptions& options,
                    const PatchObserver& observer) {
  const std::vector<KeyframeId> neighbours = NeighboursAndTheirs(*map, id, options);
  std::set<LandmarkId> changed;
  for (KeyframeId neighbour : neighbours) {
    FuseInto(map, neighbour, ValidLandmarks(map->At(id)), camera, options, observer, &changed);
  }
  std::set<LandmarkId> around;
  for (KeyframeId neighbour : neighbours) {
    for (LandmarkId landmark : ValidLandmarks(map->At(neighbour))) around.insert(landmark);
  }
  FuseInto(map, id, {around.begin(), around.end()}, camera, options, observer, &changed);
  for (LandmarkId landmark : changed) {
    if (map->Contains(landmark)) map->UpdateAppearance(landmark);
  }
}

}  // namespace deepuav
