#include "deepuav/simulation/world/traffic.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/noise.h"

namespace deepuav {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

// The prototypes' order.
constexpr int kCars = 3, kLorry = 3, kPerson = 4;
constexpr double kStoppingS = 3;
constexpr double kCarSlotM = 9, kPersonSlotM = 3;

struct CarShape {
  float length, width, bonnet, roof, nose,
      tail;  // Heights of bonnet and roof, lengths of nose and tail.
};

FaceMesh MakeCar(const CarShape& shape) {
  FaceMesh mesh;
  const Vector3f x = Vector3f::UnitX();
  const FaceMesh::Look paint{Finish::kPaint, 0.5f, 1}, dark{Finish::kDark, 0.04f, 2};
  const FaceMesh::Look glass{Finish::kGlass, 0.05f, 3};
  mesh.AddBox({{0, 0, 0.32f}, x, shape.length, shape.width, shape.bonnet - 0.32f}, paint, paint);
  for (const float side : {-1.0f, 1.0f}) {
    for (const float end : {-0.3f, 0.3f}) {
      mesh.AddBox({{end * shape.length, side * (shape.width / 2 - 0.1f), 0}, x, 0.62f, 0.24f, 0.6f},
                  dark, dark);
    }
    mesh.AddBox(
        {{side * (shape.length / 2 - 0.05f), 0, 0.5f}, x, 0.14f, 0.85f * shape.width, 0.18f},
        {Finish::kPaint, 0.9f, 4}, {Finish::kPaint, 0.9f, 4});
  }
  // The cabin: glass all round under a painted roof.
  const float front = shape.length / 2 - shape.nose, back = -shape.length / 2 + shape.tail;
  const float w = shape.width / 2 - 0.06f, rw = w - 0.16f, rake = 0.45f;
  const float low = shape.bonnet, high = shape.roof;
  const Vector3f fl(front, w, low), fr(front, -w, low), bl(back, w, low), br(back, -w, low);
  const Vector3f tfl(front - rake, rw, high), tfr(front - rake, -rw, high),
      tbl(back + rake, rw, high), tbr(back + rake, -rw, high);
  mesh.AddQuad(fl, fr, tfr, tfl, glass);
  mesh.AddQuad(br, bl, tbl, tbr, glass);
  mesh.AddQuad(bl, fl, tfl, tbl, glass);
  mesh.AddQuad(fr, br, tbr, tfr, glass);
  mesh.AddQuad(tfr, tfl, tbl, tbr, paint);
  return mesh;
}

FaceMesh MakeLorry() {
  FaceMesh mesh;
  const Vector3f x = Vector3f::UnitX();
  const FaceMesh::Look dark{Finish::kDark, 0.04f, 2};
  mesh.AddBox({{3.2f, 0, 0.5f}, x, 1.9f, 2.2f, 1.9f}, {Finish::kPaint, 0.5f, 1},
              {Finish::kPaint, 0.5f, 1});
  mesh.AddQuad({4.16f, 1, 1.3f}, {4.16f, -1, 1.3f}, {4.16f, -1, 2.2f}, {4.16f, 1, 2.2f},
               {Finish::kGlass, 0.05f, 3});
  mesh.AddBox({{-0.9f, 0, 0.8f}, x, 6, 2.4f, 2.6f}, {Finish::kPrint, 0.5f, 11},
              {Finish::kMetalRoof, 0.6f, 12});
  for (const float side : {-1.0f, 1.0f}) {
    for (const float end : {-2.8f, 0.3f, 3.2f}) {
      mesh.AddBox({{end, side, 0}, x, 0.95f, 0.3f, 0.95f}, dark, dark);
    }
  }
  return mesh;
}

FaceMesh MakePerson() {
  FaceMesh mesh;
  const Vector3f x = Vector3f::UnitX();
  const FaceMesh::Look trousers{Finish::kDark, 0.1f, 1}, shirt{Finish::kCloth, 0.5f, 2};
  for (const float side : {-0.11f, 0.11f}) {
    mesh.AddBox({{0, side, 0}, x, 0.2f, 0.17f, 0.85f}, trousers, trousers);
  }
  mesh.AddBox({{0, 0, 0.85f}, x, 0.26f, 0.48f, 0.62f}, shirt, shirt);
  mesh.AddBall({{0, 0, 1.62f}, {0.12f, 0.11f, 0.15f}, 1, 0}, {Finish::kCloth, 0.35f, 3});
  return mesh;
}

// Time that is lost by slowing down evenly to nothing, `since_s` after the brakes.
double SlowedBy(double since_s) {
  if (since_s <= 0) return 0;
  return since_s < kStoppingS ? since_s * since_s / (2 * kStoppingS) : since_s - kStoppingS / 2;
}

double SpeedOf(RoadClass road_class) {
  switch (road_class) {
    case RoadClass::kTrack:
      return 5;
    case RoadClass::kStreet:
      return 9;
    case RoadClass::kHighway:
      break;
  }
  return 16;
}

// The point at a length along the road, and the direction there.
std::pair<Vector2d, Vector2d> PointOnRoad(const Road& road, double along_m) {
  const auto after = std::upper_bound(road.arc_m.begin(), road.arc_m.end(), along_m);
  const auto i = static_cast<size_t>(
      std::clamp<std::ptrdiff_t>(after - road.arc_m.begin(), 1, std::ssize(road.arc_m) - 1));
  const Vector2d span = road.points[i] - road.points[i - 1];
  const double length = road.arc_m[i] - road.arc_m[i - 1];
  return {road.points[i - 1] + (along_m - road.arc_m[i - 1]) / length * span, span / length};
}

}  // namespace

Traffic::Traffic(const SceneOptions& options, const RoadNetwork& roads, const Terrain& terrain)
    : roads_(roads),
      terrain_(terrain),
      stop_s_(options.traffic_stop_s),
      stands_s_(options.traffic_stands_s) {
  Random random(HashCell(options.seed, 6, 0x74affu));
  for (size_t r = 0; r < roads.roads().size(); ++r) {
    const Road& road = roads.roads()[r];
    const double busy = road.road_class == RoadClass::kTrack ? 0.1 : 1;
    for (const double direction : {1.0, -1.0}) {
      // All on one lane keep its speed, in slots, so that none runs into another.
      const double speed = options.traffic_speed_factor * direction * SpeedOf(road.road_class) *
                           random.Uniform(0.85, 1.15);
      const auto lane = static_cast<float>(-direction * 0.48 * road.half_width_m);
      const double chance = busy * options.cars_per_km / 2 * kCarSlotM / 1000;
      for (double at = 0; at + kCarSlotM < road.length_m(); at += kCarSlotM) {
        if (random.Uniform(0, 1) >= chance) continue;
        const int prototype = random.Index(7) == 0 ? kLorry : random.Index(kCars);
        const auto seed = static_cast<uint32_t>(random.Index(1 << 30));
        const bool lorry = UnitFromHash(HashCell(0, 0, seed)) < options.lorry_fraction;
        movers_.push_back({lorry ? kLorry : prototype, seed, static_cast<int>(r), lane, speed, at});
      }
      if (road.road_class == RoadClass::kHighway) continue;
      const double walking = options.traffic_speed_factor * direction * random.Uniform(1.1, 1.6);
      const double walk_chance = options.people_per_km / 2 * kPersonSlotM / 1000;
      for (double at = 0; at + kPersonSlotM < road.length_m(); at += kPersonSlotM) {
        if (random.Uniform(0, 1) >= walk_chance) continue;
        const auto side =
            static_cast<float>(-direction * (road.half_width_m + random.Uniform(0.3, 1.6)));
        const auto seed = static_cast<uint32_t>(random.Index(1 << 30));
        movers_.push_back({kPerson, seed, static_cast<int>(r), side, walking, at});
      }
    }
  }
}

std::vector<FaceMesh> Traffic::MakePrototypes() {
  return {MakeCar({4.4f, 1.8f, 0.95f, 1.45f, 1.25f, 0.7f}),
          MakeCar({3.9f, 1.7f, 1.0f, 1.55f, 0.95f, 0.1f}),
          MakeCar({4.9f, 1.95f, 1.1f, 1.95f, 0.9f, 0.05f}), MakeLorry(), MakePerson()};
}

double Traffic::TravelOf(const Mover& mover, double time_s) const {
  double driven_s = time_s;
  if (stands_s_ > 0)
    driven_s -= SlowedBy(time_s - stop_s_ + kStoppingS) - SlowedBy(time_s - stop_s_ - stands_s_);
  return mover.start_m + mover.speed_m_s * driven_s;
}

double Traffic::LapOf(const Mover& mover, double time_s) const {
  const Road& road = roads_.roads()[static_cast<size_t>(mover.road)];
  return std::floor(TravelOf(mover, time_s) / road.length_m());
}

bool Traffic::Jumps(const Mover& mover, double from_s, double to_s) const {
  return LapOf(mover, from_s) != LapOf(mover, to_s);
}

Placement Traffic::PlacementAt(const Mover& mover, double time_s) const {
  const Road& road = roads_.roads()[static_cast<size_t>(mover.road)];
  const double along = TravelOf(mover, time_s) - LapOf(mover, time_s) * road.length_m();
  // Between points ahead and behind, so that bends are taken smoothly.
  constexpr double kHalfBaseM = 2.5;
  const auto offset_point = [&](double at) {
    const auto [point, direction] = PointOnRoad(road, std::clamp(at, 0.0, road.length_m()));
    const Vector2d shifted = point + mover.lane_m * Vector2d(-direction.y(), direction.x());
    return Vector3d(shifted.x(), shifted.y(), terrain_.Height(shifted.x(), shifted.y()));
  };
  const Vector3d ahead = offset_point(along + kHalfBaseM),
                 behind = offset_point(along - kHalfBaseM);
  const double sense = mover.speed_m_s < 0 ? -1 : 1;
  const Vector3d forward = sense * (ahead - behind).normalized();
  const Vector3d left = Vector3d::UnitZ().cross(forward).normalized();
  Placement placement;
  placement.col(0) = forward.cast<float>();
  placement.col(1) = left.cast<float>();
  placement.col(2) = forward.cross(left).cast<float>();
  placement.col(3) = offset_point(along).cast<float>();
  return placement;
}

}  // namespace deepuav
