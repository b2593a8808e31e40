#pragma once

#include <memory>
#include <optional>

#include "deepuav/base/stages.h"
#include "deepuav/features/turned_describer.h"
#include "deepuav/looping/loop_closer.h"
#include "deepuav/mapping/mapper.h"

namespace deepuav {

using LocalMapPtr = std::shared_ptr<const LocalMap>;

/// What becomes of a keyframe behind the Tracker: it goes into the map, then loops are closed with
/// it. Thread-compatible.
class BackEnd {
 public:
  /// The pointers must outlive it; `loop_closer` may be null, as may `turned` and `stages`.
  BackEnd(Atlas* atlas, Mapper* mapper, LoopCloser* loop_closer, TurnedDescriber* turned,
          StageListener* stages);

  /// Nothing when the two views do not hold as a map.
  LocalMapPtr StartMap(const InitialMapRequest& request);
  LocalMapPtr InsertKeyframe(const KeyframeRequest& request);
  /// With the keyframe inserted last; corrects the map where a loop is closed.
  void CloseLoops();

  int closed_loops() const { return closed_loops_; }
  int merged_maps() const { return merged_maps_; }

 private:
  Atlas* atlas_;
  Mapper* mapper_;
  LoopCloser* loop_closer_;
  TurnedDescriber* turned_;
  StageListener* stages_;
  struct Newest {
    MapId map;
    KeyframeId keyframe;
    Frame frame;  ///< With its image.
  };
  std::optional<Newest> newest_;
  int closed_loops_ = 0, merged_maps_ = 0;
};

}  // namespace deepuav
