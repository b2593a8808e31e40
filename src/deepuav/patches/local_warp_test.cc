#include "deepuav/patches/local_warp.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

Eigen::Matrix2d Turned(double angle_rad, double scale) {
  return scale * Eigen::Rotation2D<double>(angle_rad).toRotationMatrix();
}

/// Points of one image and where an affinity takes them, with noise; a share of them anywhere.
std::vector<PointPair> Pairs(const Eigen::Matrix2d& warp, int count, double wrong, Random* random) {
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d a(random->Uniform(0, 600), random->Uniform(0, 400));
    Eigen::Vector2d b = warp * a + Eigen::Vector2d(40, -20) +
                        Eigen::Vector2d(random->Gaussian(0.4), random->Gaussian(0.4));
    if (random->Uniform(0, 1) < wrong) b = {random->Uniform(0, 600), random->Uniform(0, 400)};
    pairs.push_back({a, b});
  }
  return pairs;
}

TEST(LocalWarpsTest, FindsTurnAndScale) {
  Random random(1);
  const Eigen::Matrix2d warp = Turned(2, 1.3);
  for (const auto& found : LocalWarps(Pairs(warp, 200, 0, &random))) {
    ASSERT_TRUE(found);
    EXPECT_LT((*found - warp).norm(), 0.1);
  }
}

TEST(LocalWarpsTest, WrongPairsAreLeftOutAndDoNoHarm) {
  Random random(2);
  const Eigen::Matrix2d warp = Turned(0.3, 0.9);
  const std::vector<PointPair> pairs = Pairs(warp, 300, 0.2, &random);
  const auto warps = LocalWarps(pairs);
  int right = 0, wrong = 0, good = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const bool is_true =
        (warp * pairs[i].a_px + Eigen::Vector2d(40, -20) - pairs[i].b_px).norm() < 3;
    if (!warps[i]) continue;
    ++(is_true ? right : wrong);
    good += (*warps[i] - warp).norm() < 0.15;
  }
  EXPECT_GT(right, 200);
  EXPECT_LE(wrong, 3);
  EXPECT_GT(good, 190);
}

TEST(LocalWarpsTest, TooFewOrOnALineTellNothing) {
  Random random(3);
  for (const auto& found : LocalWarps(Pairs(Turned(0, 1), 4, 0, &random))) EXPECT_FALSE(found);
  std::vector<PointPair> line;
  for (int i = 0; i < 30; ++i) line.push_back({{10.0 * i, 5.0}, {10.0 * i, 8.0}});
  for (const auto& found : LocalWarps(line)) EXPECT_FALSE(found);
  EXPECT_TRUE(LocalWarps({}).empty());
}

TEST(LocalWarpsTest, AMirrorIsNoView) {
  Random random(4);
  const Eigen::Matrix2d mirror = (Eigen::Matrix2d() << -1, 0, 0, 1).finished();
  for (const auto& found : LocalWarps(Pairs(mirror, 100, 0, &random))) EXPECT_FALSE(found);
}

}  // namespace
}  // namespace deepuav
