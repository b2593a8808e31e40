#include "deepuav/geometry/pixel_noise.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

namespace deepuav {
namespace {

Eigen::Matrix2d Slanted() { return (Eigen::Matrix2d() << 0.5, 0.3, 0.3, 0.4).finished(); }

TEST(PixelNoiseTest, WhiteningGivesTheMahalanobisDistance) {
  const Eigen::Vector2d error(0.7, -1.2);
  const double expected = error.dot(Slanted().inverse() * error);
  EXPECT_NEAR((Whitening(PixelNoise(Slanted())) * error).squaredNorm(), expected, 1e-5);
}

TEST(PixelNoiseTest, WhiteningOfASigmaDividesByIt) {
  const Eigen::Vector2d whitened = Whitening(PixelNoise(0.5)) * Eigen::Vector2d(1, -3);
  EXPECT_EQ(whitened, Eigen::Vector2d(2, -6));
}

TEST(PixelNoiseTest, SumsAddVariances) {
  const PixelNoise sum = PixelNoise(Slanted()) + PixelNoise(2.0);
  EXPECT_NEAR((sum.Covariance() - Slanted() - 4 * Eigen::Matrix2d::Identity()).norm(), 0, 1e-6);
  EXPECT_EQ(PixelNoise(3.0).Plus(4.0), PixelNoise(5.0));
  EXPECT_NEAR(PixelNoise(3.0).SigmaPx(), 3, 1e-6);
}

TEST(PixelNoiseTest, MeanSquaredGainIsOverAllDirections) {
  const Whitening whitening(PixelNoise{Slanted()});
  double sum = 0;
  constexpr int kDirections = 360;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2 * M_PI * i / kDirections;
    sum += (whitening * Eigen::Vector2d(std::cos(angle), std::sin(angle))).squaredNorm();
  }
  EXPECT_NEAR(whitening.MeanSquaredGain(), sum / kDirections, 1e-9);
}

TEST(PixelNoiseTest, OnlyPositiveDefiniteOnesAreUsable) {
  EXPECT_TRUE(PixelNoise(Slanted()).usable());
  EXPECT_FALSE(PixelNoise(0.0).usable());
  EXPECT_FALSE(PixelNoise(std::numeric_limits<double>::infinity()).usable());
  EXPECT_FALSE(PixelNoise(std::numeric_limits<double>::quiet_NaN()).usable());
  PixelNoise flat(1.0);
  flat.xy = 1;
  EXPECT_FALSE(flat.usable());
}

}  // namespace
}  // namespace deepuav
