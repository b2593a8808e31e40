#include "deepuav/sensors/georeference_hypothesis.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"
#include "support/flights.h"

namespace deepuav {
namespace {

constexpr double kSigma_m = 0.5;
const Sim3 kMapFromLocal(0.05, RotationExp({0.3, -1.2, 0.4}), {1, -2, 3});
const Eigen::Vector3d kDown = kMapFromLocal.rotation() * Eigen::Vector3d(0, 0, -1);

/// Of a flight over some hundred metres, measured where the camera is.
PathPositions Measured(int count) {
  constexpr double kSize = 10, kRate_hz = 5;
  Random random(3);
  PathPositions positions;
  for (TimedPose pose : MakeFlight(count, kRate_hz)) {
    pose.world_from_cam =
        SE3(pose.world_from_cam.rotation(), kSize * pose.world_from_cam.translation());
    PositionOnPath& at = positions.emplace_back();
    at.camera = MoveTrajectory(kMapFromLocal, {pose}).front();
    at.sigma_m.setConstant(kSigma_m);
    at.position_m = pose.world_from_cam.translation();
    for (double& value : at.position_m) value += random.Gaussian(kSigma_m);
  }
  return positions;
}

PathHypothesis Best(const PathPositions& positions) {
  return BestHypothesis(positions, Eigen::Vector3d::Zero(), kDown);
}

TEST(BestHypothesis, IsNearlyWhereThePathIs) {
  const PathHypothesis best = Best(Measured(300));
  EXPECT_NEAR(best.estimate.local_from_world.scale() * kMapFromLocal.scale(), 1, 0.02);
  EXPECT_LT(best.median, 2);
}

/// Three positions of which one is always wrong place the path nowhere.
TEST(BestHypothesis, AWholeThirdMayBeSpoofed) {
  for (int third = 0; third < 3; ++third) {
    PathPositions positions = Measured(300);
    for (size_t i = 0; i < 100; ++i)
      positions[static_cast<size_t>(third) * 100 + i].position_m += Eigen::Vector3d(30, 0, 0);
    const PathHypothesis best = Best(positions);
    EXPECT_NEAR(best.estimate.local_from_world.scale() * kMapFromLocal.scale(), 1, 0.03) << third;
    EXPECT_LT(best.median, 3) << third;
  }
}

TEST(BestHypothesis, NeedsThreePositions) {
  for (const int count : {0, 1, 2}) EXPECT_TRUE(std::isinf(Best(Measured(count)).median)) << count;
  for (const int count : {3, 4, 5}) EXPECT_LT(Best(Measured(count)).median, 3) << count;
}

}  // namespace
}  // namespace deepuav
