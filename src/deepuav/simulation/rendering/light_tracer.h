#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "deepuav/simulation/rendering/moving_scene.h"
#include "deepuav/simulation/rendering/sky.h"
#include "deepuav/simulation/world/world_geometry.h"

namespace deepuav {

/// Eight rays that are traced at once.
struct RayPacket {
  static constexpr int kSize = 8;

  alignas(32) RTCRayHit8 rays;
  alignas(32) std::array<int, kSize> valid{};  ///< -1 or 0, as Embree has it.
  std::array<bool, kSize> moving{};            ///< Set by Intersect: the hit is on a mover.

  /// Sets one ray; depth (ray parameter) 1 is at origin + direction.
  void Set(int lane, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
           float ray_time);
  bool Hits(int lane) const {
    return valid[static_cast<size_t>(lane)] != 0 &&
           rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
  }
  float Depth(int lane) const { return rays.ray.tfar[lane]; }
  Eigen::Vector3f Direction(int lane) const {
    return {rays.ray.dir_x[lane], rays.ray.dir_y[lane], rays.ray.dir_z[lane]};
  }
};

/// Finds what rays meet and how light that is. `moving` may be null: standing things alone.
class LightTracer {
 public:
  LightTracer(const WorldGeometry& world, const Sky& sky, const MovingScene* moving)
      : world_(world), sky_(sky), moving_(moving) {}

  void Intersect(RayPacket* packet) const;

  /// The point that a lane hits, after Intersect.
  SurfacePoint PointAt(const RayPacket& packet, int lane) const;

  /// After Intersect: which lanes hit something standing that the sun would reach but for a mover.
  std::array<bool, RayPacket::kSize> InMovingShadow(const RayPacket& packet) const;

  /// Intersects and returns the radiance each ray brings; 0 for rays that are not valid. A pixel is
  /// `pixel_size` wide at depth 1.
  std::array<float, RayPacket::kSize> Radiance(RayPacket* packet, float pixel_size) const;

 private:
  struct Lit;
  struct ShadowRays;
  void FindShadows(const RayPacket& packet, std::array<Lit, RayPacket::kSize>* points) const;

  const WorldGeometry& world_;
  const Sky& sky_;
  const MovingScene* moving_;
};

}  // namespace deepuav
