#pragma once

#include <algorithm>
#include <cassert>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "deepuav/map/gauge.h"
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
  /// The same, those with most keyframes first, of equal ones that of the lower id.
  std::vector<MapId> BySize() const {
    std::vector<MapId> ids = Remaining();
    std::stable_sort(ids.begin(), ids.end(), [this](MapId a, MapId b) {
      return At(a).KeyframeCount() > At(b).KeyframeCount();
    });
    return ids;
  }
  /// Moves all that `from` holds into `into`, as Map::Absorb.
  void Merge(MapId from, MapId into, KeyframeId parent) {
    from = Current(from), into = Current(into);
    assert(from != into);
    At(into).Absorb(&At(from), parent);
    gauges_.erase(from);
    merged_into_[from] = into;
  }

  /// Forgets all that `from` holds; who asks for it gets `into`.
  void GiveUp(MapId from, MapId into) {
    from = Current(from), into = Current(into);
    assert(from != into);
    At(from) = Map(from);
    gauges_.erase(from);
    merged_into_[from] = into;
  }

  /// What the world of a map means; free unless it was changed.
  Gauge GaugeOf(MapId map) const {
    const auto found = gauges_.find(Current(map));
    return found == gauges_.end() ? Gauge{} : found->second;
  }
  /// Moves all of a map, its keyframes' scales included, so that its world means what `gauge` says.
  void ChangeGauge(MapId map, const Sim3& new_from_old, const Gauge& gauge) {
    At(map).Transform(new_from_old);
    gauges_[Current(map)] = gauge;
  }

  /// Gives what all maps measured other places in the undistorted camera.
  void MovePixels(const PixelMove& move) {
    for (Map& map : maps_) map.MovePixels(move);
  }

  IdSource& ids() { return ids_; }
  const IdSource& ids() const { return ids_; }

 private:
  std::deque<Map> maps_;
  std::map<MapId, MapId> merged_into_;
  std::map<MapId, Gauge> gauges_;  ///< Of remaining maps whose gauge is not free.
  IdSource ids_;
};

}  // namespace deepuav
