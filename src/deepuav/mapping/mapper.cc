#include "deepuav/mapping/mapper.h"

#include <algorithm>

#include "deepuav/base/option_check.h"
#include "deepuav/map/all_keyframes.h"
#include "deepuav/map/frame_motion.h"
#include "deepuav/mapping/camera/readout_change.h"
#include "deepuav/mapping/correction.h"
#include "deepuav/mapping/keyframe_relocation.h"

namespace deepuav {
void MappingOptions::Check() const {
  CheckOptions("mapping", *this);
  patches.Check();
}

Mapper::Mapper(const Camera& camera, const MappingOptions& options, Atlas* atlas,
               StageListener* stages, Matcher* learned)
    : camera_(camera),
      told_pinhole_(camera.pinhole),
      options_(options),
      atlas_(atlas),
      stages_(stages),
      learned_(learned),
      observer_(camera, options.patches, options.local_map.reference, options.surface) {
  options_.Check();
}

void Mapper::Resume() {
  young_.clear();
  for (const MapId map_id : atlas_->Remaining()) {
    const Map& map = atlas_->At(map_id);
    std::vector<KeyframeId> keyframes = AllKeyframes(map);
    std::sort(keyframes.begin(), keyframes.end());
    map.landmarks().ForEach([&](const Landmark& landmark) {
      const auto later = keyframes.end() -
                         std::upper_bound(keyframes.begin(), keyframes.end(), landmark.created_by);
      if (later <= options_.young_keyframes)
        young_[map_id].push_back({landmark.id, static_cast<int>(later)});
    });
  }
}

std::shared_ptr<const LocalMap> Mapper::StartMap(const InitialMapRequest& request) {
  const StageScope stage(stages_, "start map");
  Map map(atlas_->NextMap());
  map.SetModelSigma(options_.model_noise.initial_sigma_px);
  const KeyframeId first = atlas_->ids().NextKeyframe(), second = atlas_->ids().NextKeyframe();
  const double between_s = SecondsBetween(request.first.time, request.second.time);
  map.AddKeyframe(
      first, MovingOn(request.first, SE3(), request.second_from_first, -between_s, camera_), SE3());
  map.AddKeyframe(second,
                  MovingOn(request.second, request.second_from_first, SE3(), between_s, camera_),
                  request.second_from_first);
  for (const InitialMapRequest::Point& point : request.points) {
    const LandmarkId landmark = atlas_->ids().NextLandmark();
    map.AddLandmark(landmark, point.position_first, second);
    map.AddObservation(first, point.keypoint_first, landmark);
    map.AddObservation(second, point.keypoint_second, landmark);
    map.UpdateAppearance(landmark);
  }
  map.ConnectToParent(second, first);
  MeasureStart(request, first, second, &map);
  AdjustWindow(&map, {first, second}, camera_.pinhole, options_.global_bundle, TrustInAll());
  const double depth = map.MedianDepth(first);
  const auto proposed = static_cast<double>(request.points.size());
  if (!(depth > 0) || map.LandmarkCount() < options_.min_start_ratio * proposed) return nullptr;
  map.Rescale(1 / depth);
  observer_.UpdateNormals(first, &map);
  std::vector<YoungLandmark>& young = young_[map.id()];
  map.landmarks().ForEach([&young](const Landmark& landmark) { young.push_back({landmark.id}); });
  return MakeLocalMap(atlas_->Add(std::move(map)), second, options_.local_map);
}

void Mapper::MeasureStart(const InitialMapRequest& request, KeyframeId first, KeyframeId second,
                          Map* map) const {
  for (const InitialMapRequest::Point& point : request.points) {
    const LandmarkId landmark = map->At(first).landmarks[static_cast<size_t>(point.keypoint_first)];
    if (!landmark.valid() ||
        map->At(second).landmarks[static_cast<size_t>(point.keypoint_second)] != landmark)
      continue;
    const auto measured =
        observer_.MeasurePair(map->At(first), point.keypoint_first, point.position_first,
                              map->At(second), point.keypoint_second);
    if (!measured) continue;
    map->SetMeasurement(first, landmark,
                        *observer_.ReferenceMeasurement(map->At(first), point.keypoint_first,
                                                        point.position_first));
    map->SetMeasurement(second, landmark, *measured);
  }
}

std::shared_ptr<const LocalMap> Mapper::InsertKeyframe(const KeyframeRequest& request) {
  Map& map = atlas_->At(request.map);
  const KeyframeId keyframe = AddKeyframe(request, &map);
  CullYoungLandmarks(&map);
  {
    const StageScope stage(stages_, "create landmarks");
    const auto created = CreateLandmarks(&map, keyframe, camera_.pinhole, &atlas_->ids(),
                                         options_.creation, observer_, learned_);
    for (const LandmarkId landmark : created) young_[map.id()].push_back({landmark});
  }
  {
    const StageScope stage(stages_, "fuse");
    FuseDuplicates(&map, keyframe, camera_, options_.fusion, observer_);
  }
  AdjustLocally(keyframe, &map);
  {
    const StageScope stage(stages_, "lay surfaces");
    observer_.UpdateNormals(keyframe, &map);
  }
  CullKeyframes(keyframe, &map);
  const StageScope stage(stages_, "publish local map");
  return MakeLocalMap(map, keyframe, options_.local_map);
}

KeyframeId Mapper::AddKeyframe(const KeyframeRequest& request, Map* map) {
  const StageScope stage(stages_, "insert keyframe");
  for (const ViewCount& view : request.views) {
    if (const auto landmark = map->Current(view.landmark))
      map->CountViews(*landmark, view.visible, view.found);
  }
  const KeyframeId id = atlas_->ids().NextKeyframe();
  map->AddKeyframe(id, request.frame, map->PoseOf(request.pose));
  for (const LandmarkMatch& match : request.matches) {
    const auto landmark = map->Current(match.landmark);
    if (!landmark) continue;
    map->AddObservation(id, match.keypoint, *landmark, match.measured);
    map->UpdateAppearance(*landmark);
  }
  map->ConnectToParent(id, map->Remaining(request.pose.keyframe));
  return id;
}

void Mapper::CullYoungLandmarks(Map* map) {
  const StageScope stage(stages_, "cull landmarks");
  std::vector<YoungLandmark> still_young;
  for (const auto& [id, age_before] : TakeYoung(*map)) {
    if (!map->Contains(id)) continue;
    const Landmark& landmark = map->At(id);
    const int age = age_before + 1;
    if (landmark.found < options_.min_found_ratio * landmark.visible) {
      map->RemoveLandmark(id);
    } else if (age >= options_.young_keyframes &&
               static_cast<int>(landmark.observations.size()) < options_.min_young_observations) {
      map->RemoveLandmark(id);
    } else if (age <= options_.young_keyframes) {
      still_young.push_back({id, age});
    }
  }
  young_[map->id()] = std::move(still_young);
}

std::vector<Mapper::YoungLandmark> Mapper::TakeYoung(const Map& map) {
  std::vector<YoungLandmark> taken;
  for (auto entry = young_.begin(); entry != young_.end();) {
    if (atlas_->Current(entry->first) == map.id()) {
      taken.insert(taken.end(), entry->second.begin(), entry->second.end());
      entry = young_.erase(entry);
    } else {
      ++entry;
    }
  }
  std::sort(taken.begin(), taken.end(),
            [](const YoungLandmark& a, const YoungLandmark& b) { return a.id < b.id; });
  return taken;
}

void Mapper::AdjustLocally(KeyframeId newest, Map* map) {
  const StageScope stage(stages_, "local bundle adjustment");
  std::vector<KeyframeId> window = map->Covisible(newest, 1, options_.window_keyframes - 1);
  window.push_back(newest);
  MapTrust trust = options_.trust;
  trust.reweighing.rounds = 0;  // That gains something at the end alone.
  AdjustWindow(map, window, camera_.pinhole, options_.local_bundle, trust);
  UpdateModelSigma(map, window, camera_.pinhole, options_.model_noise);
}

void Mapper::CullKeyframes(KeyframeId newest, Map* map) {
  const StageScope stage(stages_, "cull keyframes");
  std::vector<KeyframeId> candidates = map->Covisible(newest, 1, map->KeyframeCount());
  std::sort(candidates.begin(), candidates.end());
  for (KeyframeId id : candidates) {
    const Keyframe& keyframe = map->At(id);
    if (keyframe.parent.valid() && IsRedundant(keyframe, *map)) map->RemoveKeyframe(id);
  }
}

bool Mapper::IsRedundant(const Keyframe& keyframe, const Map& map) const {
  int landmarks = 0, redundant = 0;
  for (LandmarkId id : keyframe.landmarks) {
    if (!id.valid()) continue;
    ++landmarks;
    redundant += static_cast<int>(map.At(id).observations.size()) > options_.redundant_observers;
  }
  if (redundant <= options_.redundant_ratio * landmarks) return false;
  // Without a near substitute, culling would go on along the path until hardly a keyframe is left.
  int most_shared = 0;
  for (const auto& [id, shared] : keyframe.covisible) most_shared = std::max(most_shared, shared);
  return most_shared >= options_.substitute_ratio * landmarks;
}

void Mapper::Apply(const MapCorrection& correction) {
  const StageScope stage(stages_, "apply correction");
  if (correction.merges()) {
    MergeMaps(correction, atlas_);
  } else {
    MoveKeyframes(correction.keyframes, &atlas_->At(correction.map));
  }
  Map& map = atlas_->At(correction.into);
  for (const LoopTie& tie : correction.ties) FuseTie(tie, observer_, &map);
  for (const LoopTie& tie : correction.ties) {
    FuseDuplicates(&map, tie.keyframe, camera_, options_.fusion, observer_);
  }
  AdjustLocally(correction.ties.back().keyframe, &map);
  map.CountMove();
}

void Mapper::Join(const MapCorrection& correction) { MergeMaps(correction, atlas_); }

GlobalAdjustment Mapper::PrepareAdjustment(MapId map) const {
  return GlobalAdjustment(atlas_->At(map), camera_.pinhole, options_.global_bundle);
}

void Mapper::AdjustGlobally(MapId map, Pinhole* pinhole, bool refine_focal,
                            const std::function<bool()>& stop, const MapFactors* factors) {
  const StageScope stage(stages_, "global bundle adjustment");
  BundleOptions options = options_.global_bundle;
  options.refine_focal = refine_focal;
  Map& adjusted = atlas_->At(map);
  if (!factors) {
    if (options_.fuse_at_end) FuseAll(&adjusted, stop);
    observer_.RemeasureAll(&adjusted);
  }
  AdjustMap(&adjusted, pinhole, options, options_.trust, stop, factors);
}

void Mapper::FuseAll(Map* map, const std::function<bool()>& stop) const {
  for (const KeyframeId keyframe : AllKeyframes(*map)) {
    if (stop && stop()) return;
    FuseDuplicates(map, keyframe, camera_, options_.fusion, observer_);
  }
}

void Mapper::SetAsideMoving(MapId map) {
  if (!options_.moving.set_aside) return;
  const StageScope stage(stages_, "set aside what moves");
  set_aside_ += RemoveMoving(&atlas_->At(map), options_.moving, options_.trust.hovering);
}

void Mapper::SetAsideIn(const ImageRegion& region) {
  const StageScope stage(stages_, "set aside what moves");
  for (const MapId id : atlas_->Remaining()) {
    Map& map = atlas_->At(id);
    const int before = map.LandmarkCount();
    RemoveObservationsIn(region, &map);
    set_aside_ += before - map.LandmarkCount();
  }
}

void Mapper::ChangeMotionsIn(MapId map, const std::map<KeyframeId, ReadoutMotion>& motions) {
  ChangeMotions(motions, camera_, &atlas_->At(map));
}

void Mapper::Relocate(MapId map, const std::vector<KeyframeRelocation>& relocations) {
  deepuav::Relocate(relocations, &atlas_->At(map));
}

std::optional<FoundLens> Mapper::SearchLens(MapId map, const LensSearchOptions& options,
                                            const std::function<bool()>& stop) const {
  const StageScope stage(stages_, "search lens");
  const Map& searched = atlas_->At(map);
  if (options.whole && IsWhollySearchable(camera_))
    return FindWholeLens(searched, camera_, told_pinhole_, options_.global_bundle, options, stop);
  return FindLens(searched, camera_.pinhole, options_.global_bundle, options, stop);
}

std::optional<FoundReadout> Mapper::SearchReadout(
    MapId map, const std::map<KeyframeId, ReadoutMotion>& motion_per_s,
    const std::function<bool()>& stop) const {
  const StageScope stage(stages_, "search readout");
  // What is wrong with a lens that few images told would else be taken for a readout.
  const BundleOptions bundle = SearchesWholeLens()
                                   ? FreeingTheLens(options_.global_bundle, options_.lens)
                                   : options_.global_bundle;
  return FindReadout(atlas_->At(map), camera_, motion_per_s, bundle, options_.readout, stop);
}

void Mapper::ChangeCamera(const Camera& camera, const PixelMove& move) {
  camera_ = camera;
  observer_ =
      PatchObserver(camera, options_.patches, options_.local_map.reference, options_.surface);
  atlas_->MovePixels(move);
}

}  // namespace deepuav
