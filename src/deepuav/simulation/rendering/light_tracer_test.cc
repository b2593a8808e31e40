#include "deepuav/simulation/rendering/light_tracer.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "deepuav/simulation/testing/small_land.h"
#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

using Eigen::Vector3f;

constexpr float kPixelSize = 0.003f;
constexpr auto kGroundM = static_cast<float>(kFlatLandHeightM);

WeatherOptions ClearWeather() {
  WeatherOptions weather;
  weather.sun_elevation_deg = 40;
  weather.sun_azimuth_deg = 115;
  return weather;
}

/// Flat land with balls above it, or without.
struct Scenery {
  explicit Scenery(const std::vector<Marker>& balls)
      : world(FlatLand(), balls), sky(ClearWeather(), world.geometry().textures()) {}

  RayPacket Intersect(const Vector3f& origin, const Vector3f& direction) const {
    RayPacket packet;
    packet.Set(kLane, origin, direction, 0);
    LightTracer(world.geometry(), sky, nullptr).Intersect(&packet);
    return packet;
  }
  float Radiance(const Sky& light, const Vector3f& origin, const Vector3f& direction) const {
    RayPacket packet;
    packet.Set(kLane, origin, direction, 0);
    return LightTracer(world.geometry(), light, nullptr).Radiance(&packet, kPixelSize)[kLane];
  }
  /// The ground seen from 25 m straight above.
  float GroundRadiance(const Vector3f& place) const {
    return Radiance(sky, place + Vector3f(0, 0, 25), -Vector3f::UnitZ());
  }

  /// Whether nothing stands around: some fields have bales.
  bool IsBare(double x, double y, double radius_m) const {
    return world.ClearanceHeight(x, y, radius_m) < kFlatLandHeightM + 0.01;
  }

  static constexpr int kLane = 5;  // Of a packet; the others are empty.

  World world;
  Sky sky;
};

TEST(LightTracerHits, GroundAndBallsAtTheirDepths) {
  const Eigen::Vector3d centre(4, 6, 20);
  const Scenery scenery({{centre, 1.5}});
  const LightTracer tracer(scenery.world.geometry(), scenery.sky, nullptr);
  const Vector3f origin(3.17f, -47.29f, 42);
  int bare = 0;
  for (float angle = 0.1f; angle < 6.2f; angle += 0.3f) {
    const Vector3f direction(0.9f * std::cos(angle), 0.6f * std::sin(angle), -0.8f);
    const Vector3f expected = origin + (42 - kGroundM) / 0.8f * direction;
    if (!scenery.IsBare(expected.x(), expected.y(), 3)) continue;
    ++bare;
    const RayPacket packet = scenery.Intersect(origin, direction);
    ASSERT_TRUE(packet.Hits(Scenery::kLane)) << angle;
    EXPECT_FALSE(packet.Hits(4));
    EXPECT_NEAR(packet.Depth(Scenery::kLane), (42 - kGroundM) / 0.8f, 2e-3);
    const SurfacePoint point = tracer.PointAt(packet, Scenery::kLane);
    EXPECT_LT((point.position - expected).norm(), 5e-3);
    EXPECT_NEAR(std::abs(point.geometric_normal.z()), 1, 1e-4);
    EXPECT_FALSE(point.moving);
  }
  EXPECT_GT(bare, 10);

  const Vector3f from(-10, 2, 31), towards = centre.cast<float>() - from;
  const Vector3f aside = towards.cross(Vector3f::UnitZ()).normalized();
  const auto depth = [&](float off_m) {
    return scenery.Intersect(from, towards + off_m * aside).Depth(Scenery::kLane);
  };
  // The nearest point of a ball leaves its radius of the way.
  EXPECT_NEAR(depth(0), 1 - 1.5f / towards.norm(), 0.002);
  EXPECT_LT(depth(1.4f), 1.01f);
  EXPECT_GT(depth(1.6f), 1.5f);
  EXPECT_LT(depth(-1.4f), 1.01f);
  EXPECT_GT(depth(-1.6f), 1.5f);
}

TEST(LightTracerShadow, OfABallLiesWhereTheSunSays) {
  constexpr float kRadius = 2, kAbove = 9;
  const Scenery without({});
  const Vector3f sun = without.sky.sun_direction();
  ASSERT_NEAR(sun.z(), std::sin(40 * M_PI / 180), 1e-5);
  Vector3f middle(-60, 3.3f, kGroundM);
  while (!without.IsBare(middle.x(), middle.y(), 6)) {
    middle.x() += 5;
    ASSERT_LT(middle.x(), 60);
  }
  const Vector3f ball = middle + kAbove / sun.z() * sun;
  const Scenery with({{ball.cast<double>(), kRadius}});
  // On the ground the shadow is an ellipse: as wide as the ball, and longer along the light.
  const Vector3f along = Vector3f(sun.x(), sun.y(), 0).normalized(),
                 across(-along.y(), along.x(), 0);
  const float length = kRadius / sun.z();
  const auto place = [&](float u, float v) -> Vector3f {
    return middle + u * length * along + v * kRadius * across;
  };
  const auto is_dark = [&](float u, float v) {
    const float lit = without.GroundRadiance(place(u, v)), now = with.GroundRadiance(place(u, v));
    // Nothing between: all of the sun is there or none, and the sky's light stays.
    EXPECT_TRUE(now == lit || now < 0.75f * lit) << u << " " << v;
    EXPECT_GT(now, 0.05f * lit);
    return now != lit;
  };
  for (float angle = 0; angle < 6.2f; angle += 0.4f) {
    const float u = std::cos(angle), v = std::sin(angle);
    EXPECT_TRUE(is_dark(0.93f * u, 0.93f * v)) << angle;
    EXPECT_FALSE(is_dark(1.05f * u, 1.05f * v)) << angle;
  }
  EXPECT_TRUE(is_dark(0, 0));

  WeatherOptions overcast = ClearWeather();
  overcast.sun = 0;
  const Sky dull(overcast, with.world.geometry().textures());
  const Vector3f above = place(0, 0) + Vector3f(0, 0, 25);
  EXPECT_EQ(with.Radiance(dull, above, -Vector3f::UnitZ()),
            without.Radiance(dull, above, -Vector3f::UnitZ()));
}

TEST(LightTracerPackets, SeeInEveryLaneWhatARayAloneSees) {
  const Scenery scenery({{Eigen::Vector3d(2, 1, 10), 1.2}});
  const Vector3f origin(0.3f, 0.2f, 30);
  std::array<Vector3f, RayPacket::kSize> directions;
  RayPacket packet;
  for (int lane = 0; lane < RayPacket::kSize; ++lane) {
    const auto at = static_cast<size_t>(lane);
    const auto turn = static_cast<float>(lane);
    directions[at] = {0.4f * std::sin(turn), 0.3f * std::cos(2 * turn), lane == 6 ? 0.4f : -1.0f};
    if (lane != 3) packet.Set(lane, origin, directions[at], 0);
  }
  const auto radiance =
      LightTracer(scenery.world.geometry(), scenery.sky, nullptr).Radiance(&packet, kPixelSize);
  for (size_t lane = 0; lane < radiance.size(); ++lane) {
    if (lane == 3) {
      EXPECT_EQ(radiance[lane], 0);
    } else {
      EXPECT_EQ(radiance[lane], scenery.Radiance(scenery.sky, origin, directions[lane])) << lane;
    }
  }
  EXPECT_EQ(radiance[6], scenery.sky.Radiance(directions[6].normalized()));
}

void ExpectOneMomentToStandStill(const WorldGeometry& world) {
  MovingScene moving(world);
  moving.SetInterval(3, 3);
  EXPECT_EQ(moving.RayTime(3), 0);
  EXPECT_EQ(moving.RayTime(99), 0);
  EXPECT_EQ(moving.PlacementAt(0, 0),
            world.outdoors()->traffic.PlacementAt(world.outdoors()->traffic.movers()[0], 3));
  // Who jumps back to the road's start within an exposure waits for its end.
  double jump_s = 0;
  const Traffic& traffic = world.outdoors()->traffic;
  while (!traffic.Jumps(traffic.movers()[0], jump_s, jump_s + 0.1)) jump_s += 0.1;
  moving.SetInterval(jump_s, jump_s + 0.1);
  EXPECT_EQ(moving.PlacementAt(0, 0), moving.PlacementAt(0, 1));
}

/// The small world's cars over an exposure.
TEST(LightTracerMovers, AreFoundWhereTheyAreAtTheRaysMoment) {
  const WorldGeometry& world = SmallWorld().geometry();
  const Traffic& traffic = world.outdoors()->traffic;
  MovingScene moving(world);
  constexpr double kStartS = 2, kEndS = 2.5;
  moving.SetInterval(kStartS, kEndS);
  EXPECT_FLOAT_EQ(moving.RayTime(2.25), 0.5f);
  const Sky sky(ClearWeather(), world.textures());
  const LightTracer tracer(world, sky, &moving), blind(world, sky, nullptr);
  int found = 0, seen = 0;
  for (size_t i = 0; i < traffic.movers().size(); ++i) {
    const Traffic::Mover& mover = traffic.movers()[i];
    if (traffic.Jumps(mover, kStartS, kEndS)) continue;
    EXPECT_EQ(moving.PlacementAt(static_cast<uint32_t>(i), 0), traffic.PlacementAt(mover, kStartS));
    for (const float share : {0.0f, 0.5f, 1.0f}) {
      const Placement at = moving.PlacementAt(static_cast<uint32_t>(i), share);
      const Vector3f above = at.col(3) + Vector3f(0, 0, 4);
      RayPacket packet, standing;
      packet.Set(0, above, -Vector3f::UnitZ(), share);
      standing.Set(0, above, -Vector3f::UnitZ(), share);
      tracer.Intersect(&packet);
      blind.Intersect(&standing);
      ++seen;
      if (!packet.moving[0]) continue;  // Under a tree.
      EXPECT_LT(packet.Depth(0), standing.Depth(0));
      const SurfacePoint point = tracer.PointAt(packet, 0);
      EXPECT_TRUE(point.moving);
      if (point.geometry != i) continue;  // Under another, or between the legs of a person.
      ++found;
      // The ray goes through the mover's origin, so in its frame it runs along the world's
      // vertical.
      const Vector3f up = at.leftCols<3>().inverse() * Vector3f::UnitZ();
      EXPECT_LT(point.object_position.cross(up).norm(), 2e-3f);
      EXPECT_FALSE(tracer.InMovingShadow(packet)[0]);
    }
  }
  EXPECT_GT(found, seen / 2);
  ExpectOneMomentToStandStill(world);
}

}  // namespace
}  // namespace deepuav
