#pragma once

#include <cassert>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "deepuav/map/map.h"

namespace deepuav {

/// All maps of a run; the last is the active one. References to maps stay valid. Thread-compatible.
class Atlas {
 public:
  MapId NextMap() const { return {static_cast<int64_t>(maps_.size())}; }
  /// Takes a map whose id is NextMap().
  Map& Add(Map map) { return maps_.emplace_back(std::move(map)); }

  /// The map that holds what was put into `id`: itself, or the one it was merged into.
  MapId Current(MapId id) const {
    for (auto next = merged_into_.find(id); next != merged_into_.end();
         next = merged_into_.find(id))
      id = next->second;
    return id;
  }
  Map& At(MapId id) { return maps_.at(static_cast<size_t>(Current(id).value)); }
  const Map& At(MapId id) const { return maps_.at(static_cast<size_t>(Current(id).value)); }
  /// The maps that were not merged into another, by id.
  std::vector<MapId> Remaining() const {
    std::vector<MapId> ids;
    for (const Map& map : maps_) {
      if (!merged_into_.contains(map.id())) ids.push_back(map.id());
    }
    return ids;
  }
  /// Moves all that `from` holds into `into`, as Map::Absorb.
  void Merge(MapId from, MapId into, KeyframeId parent) {
    from = Current(from), into = Current(into);
    assert(from != into);
    At(into).Absorb(&At(from), parent);
    merged_into_[from] = into;
  }

  IdSource& ids() { return ids_; }
  const IdSource& ids() const { return ids_; }

 private:
  std::deque<Map> maps_;
  std::map<MapId, MapId> merged_into_;
  IdSource ids_;
};

}  // namespace deepuav
