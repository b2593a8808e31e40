#include "deepuav/simulation/world/world.h"

#include <gtest/gtest.h>

#include "deepuav/simulation/testing/small_world.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

TEST(World, HasRoadsARiverAndClearanceOverThem) {
  const World& world = SmallWorld();
  ASSERT_FALSE(world.roads().empty());
  ASSERT_EQ(world.rivers().size(), 1u);
  EXPECT_FALSE(world.CeilingHeight());
  for (const Vector3d& point : world.roads().front().points) {
    EXPECT_NEAR(point.z(), world.GroundHeight(point.x(), point.y()), 1e-6);
  }
  double tallest = 0;
  for (double y = -140; y < 140; y += 4) {
    for (double x = -140; x < 140; x += 4) {
      const double ground = world.GroundHeight(x, y), top = world.ClearanceHeight(x, y);
      EXPECT_GE(top, ground);
      tallest = std::max(tallest, top - ground);
    }
  }
  EXPECT_GT(tallest, 5);
  EXPECT_GE(world.ClearanceHeight(0, 0, 10), world.ClearanceHeight(0, 0));
}

TEST(World, HallHasAFloorAndARoof) {
  const World hall(LoadScene("hall"));
  ASSERT_TRUE(hall.CeilingHeight());
  EXPECT_EQ(hall.GroundHeight(3, 2), 0);
  EXPECT_LT(hall.ClearanceHeight(0, 0), *hall.CeilingHeight());
  const Camera camera = TestCamera(LensModel::kPinhole);
  Renderer renderer(hall, camera, RenderOptions());
  const PathOfCamera path = [](double) { return SE3(Looking(0.2, 0.2), Vector3d(-10, 0, 3)); };
  const Rendered rendered = renderer.Render(path, 0, 0, {true, {}});
  double farthest;
  cv::minMaxLoc(rendered.depth_m, nullptr, &farthest);
  EXPECT_LT(farthest, 2 * hall.HalfExtent().norm());
  EXPECT_GT(Contrast(rendered.image), 20);
}

}  // namespace
}  // namespace deepuav
