#pragma once

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/stages.h"
#include "deepuav/estimation/bundle/model_noise.h"
#include "deepuav/map/atlas.h"
#include "deepuav/map/local_map.h"
#include "deepuav/map/map_correction.h"
#include "deepuav/map/requests.h"
#include "deepuav/mapping/adjustment/bundle_window.h"
#include "deepuav/mapping/adjustment/global_adjustment.h"
#include "deepuav/mapping/adjustment/map_adjustment.h"
#include "deepuav/mapping/adjustment/map_factors.h"
#include "deepuav/mapping/camera/lens_search.h"
#include "deepuav/mapping/camera/readout_search.h"
#include "deepuav/mapping/landmarks/fusion.h"
#include "deepuav/mapping/landmarks/landmark_creation.h"
#include "deepuav/mapping/landmarks/moving_landmarks.h"
#include "deepuav/mapping/landmarks/patch_observation.h"

namespace deepuav {

struct MappingOptions {
  double min_found_ratio =
      0.25;  ///< Frames that matched a young landmark over those that should have.
  int young_keyframes =
      2;  ///< Keyframes after its creation by which a landmark must prove itself...
  int min_young_observations = 3;  ///< ...by being seen from this many.
  int window_keyframes = 20;       ///< Keyframes adjusted together with a new one.
  double redundant_ratio =
      0.9;  ///< Share of a keyframe's landmarks seen elsewhere that makes it redundant...
  int redundant_observers = 3;    ///< ...by this many other keyframes...
  double substitute_ratio = 0.6;  ///< ...if one of them alone sees this share of all.
  PatchOptions patches;
  SurfaceNormalOptions surface;
  ModelNoiseOptions model_noise;
  LocalMapOptions local_map;
  CreationOptions creation;
  FusionOptions fusion;
  MovingLandmarkOptions moving;
  MapTrust trust;
  bool fuse_at_end = true;  ///< Landmarks with all neighbours, before the last adjustment.
  double min_start_ratio =
      0.5;  ///< Share of a new map's landmarks that must outlast its first adjustment.
  LensSearchOptions lens;
  ReadoutSearchOptions readout;
  BundleOptions local_bundle{.max_iterations = 8};
  BundleOptions global_bundle{.max_iterations = 30, .min_relative_decrease = 1e-6};

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_found_ratio", min_found_ratio, "",
          "frames that matched a young landmark over those that should have", Between(0, 1));
    visit("young_keyframes", young_keyframes, "",
          "keyframes after its creation while a landmark counts as young", Between(1, 1000));
    visit("min_young_observations", min_young_observations, "",
          "keyframes that see a landmark once it is not young", Between(2, 1000));
    visit("window_keyframes", window_keyframes, "", "keyframes adjusted together with a new one",
          Between(2, 1000));
    visit("redundant_ratio", redundant_ratio, "",
          "share of landmarks seen elsewhere that makes a keyframe redundant", Above(0, 10));
    visit("redundant_observers", redundant_observers, "",
          "other keyframes that must see these landmarks", Between(1, 1000));
    visit("substitute_ratio", substitute_ratio, "",
          "share of a redundant keyframe's landmarks that one other keyframe must see",
          Between(0, 1));
    visit("fuse_at_end", fuse_at_end, "",
          "look for all landmarks in all neighbouring keyframes before the last adjustment");
    visit("min_start_ratio", min_start_ratio, "",
          "share of a new map's landmarks that must outlast its first adjustment", Between(0, 1));
    visit.Part("local_map", local_map);
    visit.Part("reference", local_map.reference);
    visit.Part("surface", surface);
    visit.Part("model_noise", model_noise);
    visit.Part("creation", creation);
    visit.Part("epipolar", creation.epipolar);
    visit.Part("fusion", fusion);
    visit.Part("moving", moving);
    visit.Part("hovering", trust.hovering);
    visit.Part("reweighing", trust.reweighing);
    visit.Part("local_bundle", local_bundle);
    visit.Part("global_bundle", global_bundle);
    visit.Part("lens", lens);
    visit.Part("readout", readout);
  }
};

/// Builds the maps: the only writer of the atlas. Thread-compatible; keeps no thread of its own.
class Mapper {
 public:
  /// The pointers must outlive it; `stages` may be null, as may `learned`, which then finds no
  /// landmarks between keyframes.
  Mapper(const Camera& camera, const MappingOptions& options, Atlas* atlas, StageListener* stages,
         Matcher* learned = nullptr);

  /// To be called when the atlas was filled from elsewhere: finds the landmarks that have not
  /// proved themselves yet.
  void Resume();

  /// Starts a new map, with the median depth of its first view as the unit of length. Nothing when
  /// the two views do not hold as a map once adjusted.
  std::shared_ptr<const LocalMap> StartMap(const InitialMapRequest& request);

  /// Takes a frame into the map as a keyframe (Mur-Artal 2015, section VI). Returns its
  /// surroundings.
  std::shared_ptr<const LocalMap> InsertKeyframe(const KeyframeRequest& request);

  /// Applies what looping found, in one step: moves keyframes and landmarks or takes a whole map
  /// into another, fuses the landmarks seen twice and adjusts the seam.
  void Apply(const MapCorrection& correction);

  /// Makes two maps one, whose worlds a correction without anything seen twice relates.
  void Join(const MapCorrection& correction);

  /// A copy of the map to be adjusted beside the mapping.
  GlobalAdjustment PrepareAdjustment(MapId map) const;

  /// Adjusts all of a map together, and the focal length with it where `pinhole` is only a first
  /// guess. `stop`, if given, is asked between the steps. `factors`, if given, are what other
  /// sensors say of its keyframes, in its gauge; without them landmarks are looked for once more in
  /// the keyframes around, and their patches compared, before.
  void AdjustGlobally(MapId map, Pinhole* pinhole, bool refine_focal,
                      const std::function<bool()>& stop = nullptr,
                      const MapFactors* factors = nullptr);

  /// Has keyframes of a map move otherwise while they were read: ChangeMotions.
  void ChangeMotionsIn(MapId map, const std::map<KeyframeId, ReadoutMotion>& motions);

  /// Gives keyframes of a map other poses and observations: deepuav::Relocate.
  void Relocate(MapId map, const std::vector<KeyframeRelocation>& relocations);

  /// Whether all of the lens is to be searched for.
  bool SearchesWholeLens() const { return options_.lens.whole && IsWhollySearchable(camera_); }
  /// What a map that was adjusted says of a calibration that does not fit: FindWholeLens where
  /// that is asked for and can be, else FindLens.
  std::optional<FoundLens> SearchLens(MapId map, const LensSearchOptions& options,
                                      const std::function<bool()>& stop = nullptr) const;
  /// What a map that was adjusted says of how long its camera takes to read an image: FindReadout.
  std::optional<FoundReadout> SearchReadout(MapId map,
                                            const std::map<KeyframeId, ReadoutMotion>& motion_per_s,
                                            const std::function<bool()>& stop = nullptr) const;

  /// What was told of the camera before an earlier run found the one that it is made for: what a
  /// search for all of the lens holds it to.
  void TellPinhole(const Pinhole& told) { told_pinhole_ = told; }
  /// Gives a map the poses and landmarks that a search found with a lens, which is to be changed
  /// to.
  void TakeAdjusted(MapId map, const BundleWindow& adjusted) {
    WriteBack(adjusted, &atlas_->At(map));
  }
  /// Has all maps and what comes after be of another camera: `move` says where it sees pixels.
  void ChangeCamera(const Camera& camera, const PixelMove& move);

  /// Gives a map's world another meaning: moves all of it.
  void ChangeGauge(MapId map, const Sim3& new_from_old, const Gauge& gauge) {
    atlas_->ChangeGauge(map, new_from_old, gauge);
  }

  /// Forgets a map that nothing is left of: who asks for it gets `instead`.
  void GiveUp(MapId map, MapId instead) { atlas_->GiveUp(map, instead); }

  /// Removes what seems to lie on things that move, once nothing is adjusted to it any more.
  void SetAsideMoving(MapId map);
  /// Takes away, in all maps, what was observed in this part of the image.
  void SetAsideIn(const ImageRegion& region);
  /// How many landmarks those two were.
  int64_t set_aside() const { return set_aside_; }

 private:
  struct YoungLandmark {
    LandmarkId id;
    int age_keyframes = 0;  ///< Of its map, after the one that created it.
  };

  /// Where the second view of a new map shows what the first one does, by patches of the first.
  void MeasureStart(const InitialMapRequest& request, KeyframeId first, KeyframeId second,
                    Map* map) const;
  KeyframeId AddKeyframe(const KeyframeRequest& request, Map* map);
  void CullYoungLandmarks(Map* map);
  /// The young landmarks of a map and of those merged into it, in the order of their creation.
  std::vector<YoungLandmark> TakeYoung(const Map& map);
  void AdjustLocally(KeyframeId newest, Map* map);
  /// Poses are better now than when each keyframe came, so more of its landmarks are found.
  void FuseAll(Map* map, const std::function<bool()>& stop) const;
  void CullKeyframes(KeyframeId newest, Map* map);
  bool IsRedundant(const Keyframe& keyframe, const Map& map) const;

  Camera camera_;
  Pinhole told_pinhole_;  ///< Before anything was found of it.
  const MappingOptions options_;
  Atlas* atlas_;
  StageListener* stages_;
  Matcher* learned_;
  PatchObserver observer_;
  int64_t set_aside_ = 0;
  std::map<MapId, std::vector<YoungLandmark>> young_;  ///< By the map that they were created in.
};

}  // namespace deepuav
