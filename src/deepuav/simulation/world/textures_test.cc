#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "deepuav/base/error.h"
#include "deepuav/simulation/world/filtered_patterns.h"
#include "deepuav/simulation/world/material_textures.h"
#include "deepuav/simulation/world/mip_texture.h"

namespace deepuav {
namespace {

cv::Mat1b Checkerboard(int side) {
  cv::Mat1b board(side, side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) board(y, x) = (x + y) % 2 == 0 ? 255 : 0;
  }
  return board;
}

TEST(MipTexture, ReadsTexelCentresAndInterpolatesBetween) {
  const MipTexture texture(Checkerboard(8), MipTexture::Edge::kRepeat);
  EXPECT_FLOAT_EQ(texture.Sample(0.5f / 8, 0.5f / 8, 0), 1);
  EXPECT_FLOAT_EQ(texture.Sample(1.5f / 8, 0.5f / 8, 0), 0);
  EXPECT_FLOAT_EQ(texture.Sample(1.0f / 8, 0.5f / 8, 0), 0.5f);
  EXPECT_FLOAT_EQ(texture.Sample(0.5f / 8 - 3, 0.5f / 8 + 7, 0), 1);
}

TEST(MipTexture, LeavesOutDetailsFinerThanTheFootprint) {
  const MipTexture texture(Checkerboard(64), MipTexture::Edge::kRepeat);
  for (int i = 0; i < 50; ++i) {
    EXPECT_NEAR(texture.Sample(0.013f * static_cast<float>(i), 0.4f, 2.0f / 64), 0.5f, 0.01);
  }
}

TEST(MipTexture, ClampsAtTheBorderWhenToldTo) {
  cv::Mat1b ramp(2, 3);
  ramp << 0, 100, 255, 0, 100, 255;
  const MipTexture texture(ramp, MipTexture::Edge::kClamp);
  EXPECT_FLOAT_EQ(texture.Sample(-4, 0.2f, 0), 0);
  EXPECT_FLOAT_EQ(texture.Sample(9, 0.2f, 0), 1);
  EXPECT_FLOAT_EQ(texture.aspect(), 2.0f / 3);
}

TEST(MipTexture, RefusesToRepeatWhatHasNoPowerOfTwo) {
  EXPECT_THROW(MipTexture(cv::Mat1b(6, 6, uint8_t{0}), MipTexture::Edge::kRepeat), Error);
  EXPECT_THROW(MipTexture(cv::Mat1b(), MipTexture::Edge::kClamp), Error);
}

TEST(FilteredPatterns, StripesIntegrateOverTheFootprint) {
  constexpr float kPeriod = 2, kBand = 0.5f;
  EXPECT_NEAR(StripeCoverage(0.25f, kPeriod, kBand, 0.01f), 1, 1e-4);
  EXPECT_NEAR(StripeCoverage(1.25f, kPeriod, kBand, 0.01f), 0, 1e-4);
  EXPECT_NEAR(StripeCoverage(-1.75f, kPeriod, kBand, 0.01f), 1, 1e-4);
  EXPECT_NEAR(StripeCoverage(0.5f, kPeriod, kBand, 0.2f), 0.5f, 1e-4);
  EXPECT_NEAR(StripeCoverage(0.77f, kPeriod, kBand, 20), 0.25f, 0.02);
  EXPECT_NEAR(BandCoverage(1, 3, 3, 1), 0.5f, 1e-5);
}

TEST(MaterialTextures, AreCentredAndHaveContrast) {
  const MaterialTextures textures(7);
  for (int i = 0; i < kMaterialCount; ++i) {
    const MipTexture& texture = textures[static_cast<Material>(i)];
    EXPECT_NEAR(texture.Sample(0.3f, 0.3f, 4), 0.5f, 0.08) << i;
    double squares = 0;
    for (int k = 0; k < 400; ++k) {
      const float value =
          texture.Sample(0.0713f * static_cast<float>(k), 0.0391f * static_cast<float>(k), 0);
      squares += (value - 0.5) * (value - 0.5);
    }
    EXPECT_GT(std::sqrt(squares / 400), 0.1) << i;
  }
}

}  // namespace
}  // namespace deepuav
