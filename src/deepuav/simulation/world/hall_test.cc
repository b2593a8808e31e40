#include "deepuav/simulation/world/hall.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "deepuav/simulation/rendering/light_tracer.h"

namespace deepuav {
namespace {

using Eigen::Vector3f;

SceneOptions HallOptions(double extent_m = 40, int seed = 1) {
  SceneOptions options = LoadScene("hall");
  options.extent_m = extent_m;
  options.seed = seed;
  return options;
}

/// What rays meet in a hall.
struct Room {
  explicit Room(const SceneOptions& options)
      : world(options),
        hall(*world.geometry().hall()),
        sky({}, world.geometry().textures()),
        tracer(world.geometry(), sky, nullptr) {}

  /// Where a ray ends; nothing where it leaves the hall.
  std::optional<Vector3f> HitOf(const Vector3f& origin, const Vector3f& direction) const {
    RayPacket packet;
    packet.Set(0, origin, direction, 0);
    tracer.Intersect(&packet);
    if (!packet.Hits(0)) return std::nullopt;
    return tracer.PointAt(packet, 0).position;
  }

  World world;
  const Hall& hall;
  Sky sky;
  LightTracer tracer;
};

TEST(HallRoom, IsClosedButForTheStripsOfItsRoof) {
  const Room room(HallOptions());
  const Eigen::Vector2f half = room.hall.half_extent_m.cast<float>();
  int open = 0;
  for (int i = 0; i < 4000; ++i) {
    // Evenly over the sphere, by the golden angle.
    const float z = -1 + 2 * (static_cast<float>(i) + 0.5f) / 4000;
    const float angle = 2.399963f * static_cast<float>(i), level = std::sqrt(1 - z * z);
    const Vector3f direction(level * std::cos(angle), level * std::sin(angle), z);
    const auto hit = room.HitOf({0.7f, 0, 6.5f}, direction);
    if (!hit) {
      ASSERT_GT(direction.z(), 0);
      ++open;
      continue;
    }
    ASSERT_LE(std::abs(hit->x()), half.x() + 0.01f);
    ASSERT_LE(std::abs(hit->y()), half.y() + 0.01f);
    ASSERT_GE(hit->z(), -0.01f);
    ASSERT_LE(hit->z(), room.hall.ceiling_m + 0.01);
  }
  EXPECT_GT(open, 20);
  EXPECT_LT(open, 1000);

  // Its walls are where its extent says: above shelves and posters, and below the beams.
  const Vector3f origin(1.5f, 0.4f, 7.3f);
  for (const float sign : {-1.0f, 1.0f}) {
    const auto end = room.HitOf(origin, {sign, 0, 0}), side = room.HitOf(origin, {0, sign, 0});
    ASSERT_TRUE(end && side);
    EXPECT_NEAR(end->x(), sign * half.x(), 0.01);
    EXPECT_NEAR(side->y(), sign * half.y(), 0.05);
  }
  const auto floor = room.HitOf({0, 0, 5}, {0.01f, 0.02f, -1});
  ASSERT_TRUE(floor);
  EXPECT_NEAR(floor->z(), 0, 1e-4);
}

TEST(HallMesh, StaysWithinItsWallsAtEveryLength) {
  for (const double extent_m : {16.0, 25.0, 40.0, 47.0, 90.0}) {
    const Hall hall = MakeHall(HallOptions(extent_m));
    ASSERT_FALSE(hall.mesh.vertices.empty());
    for (const Vector3f& vertex : hall.mesh.vertices) {
      ASSERT_TRUE(vertex.allFinite());
      // The roof's last beam lies outside where no whole bay is left for it.
      EXPECT_GE(vertex.x(), -hall.half_extent_m.x() - 1e-5) << extent_m;
      EXPECT_LE(vertex.x(), hall.half_extent_m.x() + 1.9) << extent_m;
      EXPECT_LE(std::abs(vertex.y()), hall.half_extent_m.y() + 0.5) << extent_m;
      EXPECT_GE(vertex.z(), 0);
      EXPECT_LE(vertex.z(), hall.ceiling_m + 1e-5);
    }
    EXPECT_EQ(hall.mesh.face_of_triangle.size(), hall.mesh.triangles.size());
  }
}

TEST(HallMesh, FollowsFromTheSeed) {
  const Hall hall = MakeHall(HallOptions()), again = MakeHall(HallOptions()),
             other = MakeHall(HallOptions(40, 2));
  EXPECT_EQ(hall.mesh.vertices, again.mesh.vertices);
  EXPECT_NE(hall.mesh.vertices, other.mesh.vertices);
}

}  // namespace
}  // namespace deepuav
