#pragma once

#include <vector>

#include "deepuav/simulation/world/world_geometry.h"

namespace deepuav {

/// Where the cars and people are while one picture is taken. One per renderer.
class MovingScene {
 public:
  explicit MovingScene(const WorldGeometry& world) : world_(world) {}

  /// From now on ray time 0 is `start_s` and ray time 1 `end_s`, between which movers go straight.
  void SetInterval(double start_s, double end_s);

  /// Null where nothing moves.
  RTCScene scene() const { return scene_.get(); }

  Placement PlacementAt(uint32_t mover, float ray_time) const {
    return (1 - ray_time) * from_[mover] + ray_time * to_[mover];
  }

  float RayTime(double time_s) const {
    return length_s_ > 0 ? static_cast<float>((time_s - start_s_) / length_s_) : 0;
  }

 private:
  const WorldGeometry& world_;
  double start_s_ = 0, length_s_ = 0;
  std::vector<Placement> from_, to_;
  EmbreeScene scene_;
};

}  // namespace deepuav
