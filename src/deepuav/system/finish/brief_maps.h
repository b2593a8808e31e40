#pragma once

#include <functional>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "deepuav/map/atlas.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/system/finish/trajectory_finish.h"

namespace deepuav {

/// Maps that held for a moment while the camera was lost in another: too brief to be recognised or
/// to be joined, they keep what lies about them apart. Their frames are looked for in the other map
/// as if they were lost; a map whose frames all found a place there is given up.
class BriefMaps {
 public:
  /// Must outlive it. Maps with keyframes from before `first_new_keyframe`, which were loaded, and
  /// those that last longer than `max_s` are left as they are, as is
  /// the largest.
  BriefMaps(Atlas* atlas, KeyframeId first_new_keyframe, double max_s);

  /// Takes their poses from the frames of such maps; features are those of their keyframes, where
  /// the frames have none any more.
  void SetAside(std::vector<FrameRecord>* records);
  /// Makes that undone.
  void PutBack(std::vector<FrameRecord>* records);

  /// Gives the frames that still have no pose the one in their brief map back, as `finish` refines
  /// it, which then looks for lost ones from there; has `mapper` give up the maps of which no frame
  /// is left. Says how many.
  int Restore(const TrajectoryFinish& finish, const std::function<bool()>& stop, Mapper* mapper,
              std::vector<FrameRecord>* records);

 private:
  struct Brief {
    MapId around;                                         ///< The map before and after it.
    std::vector<std::pair<size_t, FrameRecord>> records;  ///< As they were, with their places.
  };

  void FindBrief(const std::vector<FrameRecord>& records);
  bool IsNew(MapId map) const;
  /// Of the frames before or after record i, the next one's with a pose in a map that lasts;
  /// invalid where there is none.
  MapId LastingBeside(const std::vector<FrameRecord>& records, size_t i, int step) const;

  Atlas* atlas_;
  const KeyframeId first_new_keyframe_;
  const double max_s_;
  std::set<MapId> lasting_;
  std::map<MapId, Brief> brief_;
};

}  // namespace deepuav
