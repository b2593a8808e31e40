#pragma once

#include <deque>
#include <utility>

#include "deepuav/map/map.h"

namespace deepuav {

/// All maps of a run; the last is the active one. References to maps stay valid. Thread-compatible.
class Atlas {
 public:
  MapId NextMap() const { return {static_cast<int64_t>(maps_.size())}; }
  /// Takes a map whose id is NextMap().
  Map& Add(Map map) { return maps_.emplace_back(std::move(map)); }
  Map& At(MapId id) { return maps_.at(static_cast<size_t>(id.value)); }
  const Map& At(MapId id) const { return maps_.at(static_cast<size_t>(id.value)); }
  const std::deque<Map>& maps() const { return maps_; }
  IdSource& ids() { return ids_; }
  const IdSource& ids() const { return ids_; }

 private:
  std::deque<Map> maps_;
  IdSource ids_;
};

}  // namespace deepuav
