#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "deepuav/base/stages.h"
#include "deepuav/features/turned_describer.h"
#include "deepuav/looping/loop_closer.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/system/lanes/pending_adjustment.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

using LocalMapPtr = std::shared_ptr<const LocalMap>;

/// What becomes of a keyframe behind the Tracker: it goes into the map, then loops are closed with
/// it. Thread-compatible.
class BackEnd {
 public:
  /// The pointers must outlive it. `places`, which is told of every keyframe, may be null, as may
  /// `loop_closer`, which needs it, `turned` and `stages`.
  /// `adjustment_delay_keyframes`: how many keyframes after a closed loop the map is adjusted as a
  /// whole.
  BackEnd(Atlas* atlas, Mapper* mapper, PlaceMemory* places, LoopCloser* loop_closer,
          TurnedDescriber* turned, int adjustment_delay_keyframes, StageListener* stages);

  /// From now on global adjustments are computed beside the rest and taken over after exactly so
  /// many keyframes, or (`as_soon_as_ready`) with the first keyframe after they are there.
  void AdjustBeside(bool as_soon_as_ready);

  /// Global adjustments end, with what they have reached, once `stop` (asked in any thread) is
  /// true.
  void StopWhen(std::function<bool()> stop) { stop_ = std::move(stop); }

  /// From now on `observer` (may be null; must outlive it) is told of keyframes and maps.
  void Observe(RunObserver* observer) { observer_ = observer; }

  /// Nothing when the two views do not hold as a map.
  LocalMapPtr StartMap(const InitialMapRequest& request);
  LocalMapPtr InsertKeyframe(const KeyframeRequest& request);
  /// With the keyframe inserted last, which is remembered from then on; corrects the map where a
  /// loop is closed.
  void CloseLoops();

  /// Gives up a global adjustment that is under way.
  void DropAdjustment() { adjustment_.reset(); }

  int closed_loops() const { return closed_loops_; }
  int merged_maps() const { return merged_maps_; }

 private:
  struct Newest {
    MapId map;
    KeyframeId keyframe;
    Frame frame;  ///< With its image.
  };

  std::optional<MapCorrection> FindLoop(const Newest& newest);
  /// Under the headings that may tell of a loop; the others are empty.
  TurnedDescriptors DescribeTurned(const Newest& newest) const;
  void Correct(const MapCorrection& correction);
  void StartAdjustment(MapId map);
  void FinishAdjustment();
  void ApplyAdjustment();
  void TellOfKeyframe(const Keyframe& keyframe, MapId map) const;
  void TellOfMap(MapEvent event) const;
  void SettleAdjustmentBefore(const MapCorrection& correction);

  Atlas* atlas_;
  Mapper* mapper_;
  PlaceMemory* places_;
  LoopCloser* loop_closer_;
  TurnedDescriber* turned_;
  StageListener* stages_;
  std::optional<Newest> newest_;
  const int adjustment_delay_keyframes_;
  bool adjust_beside_ = false, adjust_as_soon_as_ready_ = false;
  RunObserver* observer_ = nullptr;
  std::function<bool()> stop_;
  std::unique_ptr<PendingAdjustment> adjustment_;
  int closed_loops_ = 0, merged_maps_ = 0;
};

}  // namespace deepuav
