#include "deepuav/simulation/rendering/light_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace deepuav {
namespace {

using Eigen::Vector3f;

constexpr float kNearM = 0.05f, kFarM = 20000;
constexpr int kSize = RayPacket::kSize;

RTCIntersectContext CoherentContext() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

}  // namespace

// What shading needs of a hit.
struct LightTracer::Lit {
  Vector3f position;
  Vector3f towards_viewer;  // Unit.
  Vector3f face_normal;     // On the viewer's side.
  Surface surface;
  float depth = 0, distance = 0;
  float sun_cosine = 0;  // 0 where the sun does not reach.
};

void RayPacket::Set(int lane, const Vector3f& origin, const Vector3f& direction, float ray_time) {
  rays.ray.org_x[lane] = origin.x();
  rays.ray.org_y[lane] = origin.y();
  rays.ray.org_z[lane] = origin.z();
  rays.ray.dir_x[lane] = direction.x();
  rays.ray.dir_y[lane] = direction.y();
  rays.ray.dir_z[lane] = direction.z();
  rays.ray.tnear[lane] = kNearM;
  rays.ray.tfar[lane] = kFarM;
  rays.ray.time[lane] = ray_time;
  rays.ray.mask[lane] = ~0u;
  rays.ray.id[lane] = 0;
  rays.ray.flags[lane] = 0;
  rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  valid[static_cast<size_t>(lane)] = -1;
}

void LightTracer::Intersect(RayPacket* packet) const {
  RTCIntersectContext context = CoherentContext();
  packet->moving.fill(false);
  rtcIntersect8(packet->valid.data(), world_.static_scene(), &context, &packet->rays);
  if (moving_ == nullptr || moving_->scene() == nullptr) return;
  // The second scene overwrites what it finds nearer: tell by a hit emptied before.
  const RTCHit8 standing = packet->rays.hit;
  for (int i = 0; i < kSize; ++i) packet->rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect8(packet->valid.data(), moving_->scene(), &context, &packet->rays);
  RTCHit8& hit = packet->rays.hit;
  for (int i = 0; i < kSize; ++i) {
    if (hit.geomID[i] != RTC_INVALID_GEOMETRY_ID) {
      packet->moving[static_cast<size_t>(i)] = true;
      continue;
    }
    hit.Ng_x[i] = standing.Ng_x[i];
    hit.Ng_y[i] = standing.Ng_y[i];
    hit.Ng_z[i] = standing.Ng_z[i];
    hit.primID[i] = standing.primID[i];
    hit.geomID[i] = standing.geomID[i];
    hit.instID[0][i] = standing.instID[0][i];
  }
}

SurfacePoint LightTracer::PointAt(const RayPacket& packet, int lane) const {
  const RTCRay8& ray = packet.rays.ray;
  const RTCHit8& hit = packet.rays.hit;
  const float depth = ray.tfar[lane];
  SurfacePoint point;
  point.position = {ray.org_x[lane] + depth * ray.dir_x[lane],
                    ray.org_y[lane] + depth * ray.dir_y[lane],
                    ray.org_z[lane] + depth * ray.dir_z[lane]};
  const Vector3f normal = Vector3f(hit.Ng_x[lane], hit.Ng_y[lane], hit.Ng_z[lane]).normalized();
  const uint32_t instance = hit.instID[0][lane];
  point.triangle = hit.primID[lane];
  point.geometry = instance != RTC_INVALID_GEOMETRY_ID ? instance : hit.geomID[lane];
  if (packet.moving[static_cast<size_t>(lane)]) {
    point.moving = true;
    const Placement placement = moving_->PlacementAt(instance, ray.time[lane]);
    const Eigen::Matrix3f rotation = placement.leftCols<3>();
    point.object_position = rotation.inverse() * (point.position - placement.col(3));
    point.object_normal = normal;
    point.geometric_normal = (rotation * normal).normalized();
  } else {
    point.geometric_normal = world_.WorldNormal(point.geometry, normal);
  }
  return point;
}

// Rays towards the sun, of the lanes that are wanted.
struct LightTracer::ShadowRays {
  alignas(32) RTCRay8 rays{};
  alignas(32) std::array<int, kSize> wanted{};  // -1 or 0, as Embree has it.
  bool any = false;

  // From a point that the viewer sees `distance` away, on the viewer's side of its face.
  void Set(int lane, const Vector3f& position, const Vector3f& face_normal, float distance,
           const Vector3f& sun, float ray_time) {
    wanted[static_cast<size_t>(lane)] = -1;
    any = true;
    const float lift = 0.004f + 2e-4f * distance;
    const Vector3f origin = position + lift * face_normal;
    rays.org_x[lane] = origin.x();
    rays.org_y[lane] = origin.y();
    rays.org_z[lane] = origin.z();
    rays.dir_x[lane] = sun.x();
    rays.dir_y[lane] = sun.y();
    rays.dir_z[lane] = sun.z();
    rays.tnear[lane] = 0;
    rays.tfar[lane] = kFarM;
    rays.time[lane] = ray_time;
    rays.mask[lane] = ~0u;
    rays.id[lane] = 0;
    rays.flags[lane] = 0;
  }

  // Calls `shade` with the wanted lanes that the scene shades, which are wanted no longer.
  template <typename Shade>
  void Trace(RTCScene scene, const Shade& shade) {
    RTCIntersectContext context = CoherentContext();
    rtcOccluded8(wanted.data(), scene, &context, &rays);
    for (int i = 0; i < kSize; ++i) {
      if (wanted[static_cast<size_t>(i)] == 0 || rays.tfar[i] >= 0) continue;
      shade(static_cast<size_t>(i));
      wanted[static_cast<size_t>(i)] = 0;
    }
  }
};

void LightTracer::FindShadows(const RayPacket& packet, std::array<Lit, kSize>* points) const {
  ShadowRays shadow;
  for (int i = 0; i < kSize; ++i) {
    const Lit& lit = (*points)[static_cast<size_t>(i)];
    if (lit.sun_cosine <= 0) continue;
    shadow.Set(i, lit.position, lit.face_normal, lit.distance, sky_.sun_direction(),
               packet.rays.ray.time[i]);
  }
  if (!shadow.any) return;
  const auto shade = [&](size_t lane) { (*points)[lane].sun_cosine = 0; };
  shadow.Trace(world_.static_scene(), shade);
  if (moving_ != nullptr && moving_->scene() != nullptr) shadow.Trace(moving_->scene(), shade);
}

std::array<bool, kSize> LightTracer::InMovingShadow(const RayPacket& packet) const {
  std::array<bool, kSize> shaded{};
  if (sky_.sun() <= 0 || moving_ == nullptr || moving_->scene() == nullptr) return shaded;
  ShadowRays shadow;
  for (int i = 0; i < kSize; ++i) {
    if (!packet.Hits(i) || packet.moving[static_cast<size_t>(i)]) continue;
    const SurfacePoint point = PointAt(packet, i);
    const Vector3f direction = packet.Direction(i);
    const Vector3f& normal = point.geometric_normal;
    const Vector3f face_normal = direction.dot(normal) > 0 ? Vector3f(-normal) : normal;
    if (face_normal.dot(sky_.sun_direction()) <= 0) continue;
    shadow.Set(i, point.position, face_normal, packet.Depth(i) * direction.norm(),
               sky_.sun_direction(), packet.rays.ray.time[i]);
  }
  if (!shadow.any) return shaded;
  shadow.Trace(world_.static_scene(), [](size_t) {});
  shadow.Trace(moving_->scene(), [&](size_t lane) { shaded[lane] = true; });
  return shaded;
}

std::array<float, kSize> LightTracer::Radiance(RayPacket* packet, float pixel_size) const {
  Intersect(packet);
  std::array<Lit, kSize> points;
  const Vector3f& sun = sky_.sun_direction();
  for (int i = 0; i < kSize; ++i) {
    if (!packet->Hits(i)) continue;
    Lit& lit = points[static_cast<size_t>(i)];
    const SurfacePoint point = PointAt(*packet, i);
    const Vector3f direction = packet->Direction(i);
    const float stretch = direction.norm();
    lit.depth = packet->Depth(i);
    lit.distance = lit.depth * stretch;
    lit.towards_viewer = -direction / stretch;
    lit.position = point.position;
    const float facing = lit.towards_viewer.dot(point.geometric_normal);
    lit.face_normal = facing < 0 ? Vector3f(-point.geometric_normal) : point.geometric_normal;
    // Between the footprint's short and long side.
    constexpr float kMostGrazing = 0.06f;
    const float footprint =
        lit.depth * pixel_size / std::sqrt(std::max(std::abs(facing), kMostGrazing));
    lit.surface = world_.SurfaceAt(point, footprint);
    if (lit.surface.normal.dot(lit.face_normal) < 0) lit.surface.normal = -lit.surface.normal;
    if (sky_.sun() > 0 && lit.face_normal.dot(sun) > 0) {
      lit.sun_cosine = std::max(0.0f, lit.surface.normal.dot(sun));
    }
  }
  FindShadows(*packet, &points);

  std::array<float, kSize> radiance{};
  for (int i = 0; i < kSize; ++i) {
    if (packet->valid[static_cast<size_t>(i)] == 0) continue;
    if (!packet->Hits(i)) {
      radiance[static_cast<size_t>(i)] = sky_.Radiance(packet->Direction(i).normalized());
      continue;
    }
    const Lit& lit = points[static_cast<size_t>(i)];
    const Appearance& look = lit.surface.look;
    const Vector3f& normal = lit.surface.normal;
    float light = sky_.sun() * lit.sun_cosine + sky_.Ambient(normal);
    if (look.translucency > 0)
      light += look.translucency * sky_.sun() * std::max(0.0f, -normal.dot(sun));
    float value = look.glow + std::max(look.albedo, 0.005f) * light;
    if (look.reflectivity > 0) {
      const float cosine = std::clamp(normal.dot(lit.towards_viewer), 0.0f, 1.0f);
      const float grazing = 1 - cosine;
      const float share = look.reflectivity +
                          (1 - look.reflectivity) * grazing * grazing * grazing * grazing * grazing;
      Vector3f mirrored = 2 * cosine * normal - lit.towards_viewer;
      mirrored.z() = std::abs(mirrored.z());
      value = (1 - share) * value + share * sky_.Radiance(mirrored.normalized());
    }
    radiance[static_cast<size_t>(i)] = sky_.Hazed(value, lit.distance, -lit.towards_viewer);
  }
  return radiance;
}

}  // namespace deepuav
