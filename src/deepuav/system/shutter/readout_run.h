#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/system/shutter/readout_path.h"

namespace deepuav {

/// A run's camera and maps, as what is told of its rolling shutter changes them. All pointers must
/// outlive it. Thread-compatible.
struct ReadoutRun {
  Camera* camera;
  const Atlas* atlas;
  Mapper* mapper;
  KeyframeId first_new_keyframe;  ///< Those before it were loaded: they stay.

  /// The readout that the map tells, on whose path the camera moved so in a second.
  std::optional<FoundReadout> Search(const ReadoutPath& path_per_s, MapId map,
                                     const std::function<bool()>& stop) const;
  /// Has keyframes and frames move so; the map is to be adjusted afterwards.
  void Take(const ReadoutPath& path, MapId map, std::vector<FrameRecord>* records) const;
  void Adjust(MapId map, const std::function<bool()>& stop) const;
};

}  // namespace deepuav
