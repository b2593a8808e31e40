#pragma once

#include <optional>
#include <span>
#include <vector>

#include "deepuav/features/turned_describer.h"
#include "deepuav/localisation/relocaliser.h"
#include "deepuav/looping/place_memory.h"
#include "deepuav/map/atlas.h"
#include "deepuav/map/local_map.h"
#include "deepuav/system/lanes/back_end.h"
#include "deepuav/system/system_options.h"

namespace deepuav {

/// Finds frames that tracking lost, by the places that they look like, under any heading.
/// Thread-compatible.
class LostFrames {
 public:
  struct Recognised {
    LocalMapPtr surroundings;  ///< Of the keyframe that the frame was found near to.
    LocatedFrame located;
  };

  /// The pointers must outlive it; without `places` it finds none, without `turned` only under
  /// about the heading of a keyframe. `stages` may be null.
  LostFrames(const Camera& camera, const SystemOptions& options, PlaceMemory* places,
             TurnedDescriber* turned, PlaceMatchers matchers, StageListener* stages);

  /// Whether a frame shows enough to be looked for.
  bool MayFind(const Frame& frame) const;

  /// Nothing where no pose is sure.
  std::optional<Recognised> Find(const Frame& frame, const Atlas& atlas);

 private:
  std::optional<Recognised> FindUnder(const Frame& frame, std::span<const Descriptors> turned,
                                      const Atlas& atlas);
  /// Whether it is time to look under other headings again.
  bool TurnsAt(Timestamp time);

  PlaceMemory* places_;
  TurnedDescriber* turned_;
  const LocalMapOptions local_map_;
  const int min_keypoints_;
  const double turned_interval_s_;
  Relocaliser relocaliser_;
  std::optional<Timestamp> turned_at_;
};

}  // namespace deepuav
