#include "deepuav/sensors/positions_on_path.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

Timestamp At(double seconds) { return {static_cast<int64_t>(seconds * 1e9)}; }

LocalFix FixAt(double seconds, const Eigen::Vector3d& position_m) {
  LocalFix fix;
  fix.time = At(seconds);
  fix.position_m = position_m;
  fix.sigma_m.setOnes();
  return fix;
}

TEST(PositionsAt, AreTheFixesOwnOrBetweenThem) {
  const std::vector<LocalFix> fixes = {FixAt(1, {0, 0, 5}), FixAt(2, {10, 4, 5}),
                                       FixAt(3, {10, 4, 9})};
  const auto positions = PositionsAt({At(0.5), At(1), At(1.25), At(3), At(3.5)}, fixes, 0, 0);
  ASSERT_EQ(positions.size(), 5u);
  EXPECT_FALSE(positions[0]) << "before the first";
  ASSERT_TRUE(positions[1] && positions[2] && positions[3]);
  EXPECT_EQ(*positions[1], Eigen::Vector3d(0, 0, 5));
  EXPECT_TRUE(positions[2]->isApprox(Eigen::Vector3d(2.5, 1, 5)));
  EXPECT_EQ(*positions[3], Eigen::Vector3d(10, 4, 9));
  EXPECT_FALSE(positions[4]) << "after the last";
}

TEST(PositionsAt, AreNotKnownInLongGaps) {
  const std::vector<LocalFix> fixes = {FixAt(0, {0, 0, 0}), FixAt(1, {1, 0, 0}),
                                       FixAt(2, {2, 0, 0}), FixAt(20, {20, 0, 0})};
  EXPECT_FALSE(PositionsAt({At(10)}, fixes, 0, 2)[0]);
  EXPECT_TRUE(PositionsAt({At(10)}, fixes, 0, 30)[0]);
  EXPECT_FALSE(PositionsAt({At(10)}, {}, 0, 30)[0]);
}

TEST(PositionsAt, AddTheOffsetToTheFixesTimes) {
  const std::vector<LocalFix> fixes = {FixAt(1, {0, 0, 0}), FixAt(2, {8, 0, 0})};
  EXPECT_FALSE(PositionsAt({At(101.5)}, fixes, 0, 2)[0]);
  const auto positions = PositionsAt({At(101.5)}, fixes, 100, 2);
  ASSERT_TRUE(positions[0]);
  EXPECT_TRUE(positions[0]->isApprox(Eigen::Vector3d(4, 0, 0)));
}

TEST(PlaceOnPath, FixesThatComeMoreOftenAreInterpolated) {
  const Trajectory path{{At(0), SE3()}, {At(3), SE3()}, {At(6), SE3()}};
  std::vector<LocalFix> fixes;
  for (int i = 0; i < 60; ++i)
    fixes.push_back({At(0.1 * i + 0.05), Eigen::Vector3d(0.1 * i, 0, 0), Eigen::Vector3d::Ones()});
  const auto placed = PlaceOnPath(path, fixes, 0, 2);
  ASSERT_EQ(placed.size(), 1u);  // Nothing is extrapolated.
  EXPECT_NEAR(placed[0].position_m.x(), 2.95, 1e-9);
}

TEST(PlaceOnPath, ALongGapIsNotBridged) {
  Trajectory path;
  for (int i = 0; i < 10; ++i) path.push_back({At(i < 5 ? i * 0.1 : 10 + i * 0.1), SE3()});
  const std::vector<LocalFix> fixes{{At(0.25), Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()},
                                    {At(5), Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()},
                                    {At(10.75), Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}};
  EXPECT_EQ(PlaceOnPath(path, fixes, 0, 2).size(), 2u);
}

}  // namespace
}  // namespace deepuav
