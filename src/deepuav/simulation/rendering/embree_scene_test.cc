#include "deepuav/simulation/rendering/embree_scene.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <optional>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using Eigen::Vector3f;

constexpr FaceMesh::Look kLook{Finish::kPaint, 0.5f, 1};

/// A box of 2 x 2 x 2 on the ground about the origin.
FaceMesh Box() {
  FaceMesh mesh;
  mesh.AddBox({Vector3f::Zero(), Vector3f::UnitX(), 2, 2, 2}, kLook, kLook);
  return mesh;
}

Placement At(const Vector3f& place, float scale = 1) {
  Placement placement;
  placement << scale * Eigen::Matrix3f::Identity(), place;
  return placement;
}

struct Hit {
  float distance;
  uint32_t geometry, instance;
};

/// Straight down from 10 m.
std::optional<Hit> LookDownOn(RTCScene scene, float x, float y, float time = 0) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray.org_x = x;
  query.ray.org_y = y;
  query.ray.org_z = 10;
  query.ray.dir_z = -1;
  query.ray.tfar = 100;
  query.ray.time = time;
  query.ray.mask = ~0u;
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{query.ray.tfar, query.hit.geomID, query.hit.instID[0]};
}

TEST(EmbreeSceneTest, FindsTrianglesAndInstancesByTheirNumbers) {
  const EmbreeDevice device = MakeEmbreeDevice();
  const EmbreeScene prototype = MakePrototypeScene(device.get(), Box());
  const EmbreeScene scene(rtcNewScene(device.get()));
  const uint32_t ground = AddTriangles(device.get(), scene.get(),
                                       {{-50, -50, 0}, {50, -50, 0}, {50, 50, 0}, {-50, 50, 0}},
                                       {{0, 1, 2}, {0, 2, 3}});
  const uint32_t small = AddInstance(device.get(), scene.get(), prototype.get(), At({5, 0, 0}));
  const uint32_t large =
      AddInstance(device.get(), scene.get(), prototype.get(), At({-10, 0, 0.5f}, 3));
  rtcCommitScene(scene.get());
  EXPECT_NO_THROW(CheckEmbree(device.get(), "test"));

  const auto on_ground = LookDownOn(scene.get(), 0, 20),
             on_small = LookDownOn(scene.get(), 5.9f, 0),
             on_large = LookDownOn(scene.get(), -12.9f, 2.9f);
  ASSERT_TRUE(on_ground && on_small && on_large);
  EXPECT_EQ(on_ground->geometry, ground);
  EXPECT_EQ(on_ground->instance, RTC_INVALID_GEOMETRY_ID);
  EXPECT_NEAR(on_ground->distance, 10, 1e-5);
  EXPECT_EQ(on_small->instance, small);
  EXPECT_NEAR(on_small->distance, 8, 1e-5);
  EXPECT_EQ(on_large->instance, large);
  EXPECT_NEAR(on_large->distance, 3.5, 1e-5);
  EXPECT_EQ(LookDownOn(scene.get(), 6.1f, 0)->geometry, ground);
  EXPECT_FALSE(LookDownOn(scene.get(), 60, 0));
}

TEST(EmbreeSceneTest, AnInstanceMovesEvenlyOverTheRaysTime) {
  const EmbreeDevice device = MakeEmbreeDevice();
  const EmbreeScene prototype = MakePrototypeScene(device.get(), Box());
  const EmbreeScene scene(rtcNewScene(device.get()));
  const Placement from = At({0, 0, 0}), to = At({8, 0, 4});
  AddInstance(device.get(), scene.get(), prototype.get(), from, &to);
  rtcCommitScene(scene.get());
  for (const float time : {0.0f, 0.25f, 0.5f, 1.0f}) {
    const auto on_top = LookDownOn(scene.get(), 8 * time, 0, time);
    ASSERT_TRUE(on_top) << time;
    EXPECT_NEAR(on_top->distance, 8 - 4 * time, 1e-4);
    EXPECT_TRUE(LookDownOn(scene.get(), 8 * time + 0.99f, 0.9f, time));
    EXPECT_FALSE(LookDownOn(scene.get(), 8 * time + 1.01f, 0, time));
    EXPECT_FALSE(LookDownOn(scene.get(), 8 * time - 1.01f, 0, time));
  }
}

TEST(EmbreeSceneTest, ErrorsNameTheStepAndAreReportedOnce) {
  const EmbreeDevice device = MakeEmbreeDevice();
  // A buffer of no geometry.
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_UCHAR, 1, 3);
  rtcReleaseGeometry(geometry);
  try {
    CheckEmbree(device.get(), "the third step");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("the third step"), std::string::npos);
  }
  EXPECT_NO_THROW(CheckEmbree(device.get(), "the fourth step"));
}

}  // namespace
}  // namespace deepuav
