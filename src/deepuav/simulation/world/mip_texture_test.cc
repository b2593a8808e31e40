#include "deepuav/simulation/world/mip_texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "deepuav/base/random.h"
#include "deepuav/simulation/world/material_textures.h"

namespace deepuav {
namespace {

constexpr float kLevel = 1.0f / 255;

cv::Mat1b RandomPixels(int rows, int cols, uint64_t seed) {
  Random random(seed);
  cv::Mat1b pixels(rows, cols);
  for (uint8_t& pixel : pixels) pixel = static_cast<uint8_t>(random.Index(256));
  return pixels;
}

/// The mean of a square of pixels, 0 to 1.
double MeanOf(const cv::Mat1b& pixels, int x, int y, int side) {
  return cv::mean(pixels(cv::Rect(x, y, side, side)))[0] / 255;
}

TEST(MipTextureLevels, AreTheMeansOfTheirSquares) {
  constexpr int kSide = 64;
  const cv::Mat1b pixels = RandomPixels(kSide, kSide, 3);
  const MipTexture texture(pixels, MipTexture::Edge::kRepeat);
  for (int size = 1; size <= kSide; size *= 2) {
    const float footprint = static_cast<float>(size) / kSide;
    for (int y = 0; y < kSide; y += size) {
      for (int x = 0; x < kSide; x += size) {
        const float u = (static_cast<float>(x) + 0.5f * static_cast<float>(size)) / kSide;
        const float v = (static_cast<float>(y) + 0.5f * static_cast<float>(size)) / kSide;
        ASSERT_NEAR(texture.Sample(u, v, footprint), MeanOf(pixels, x, y, size), 0.51f * kLevel)
            << size << " at " << x << " " << y;
      }
    }
  }
  // And all of it from afar.
  EXPECT_NEAR(texture.Sample(0.3f, 0.9f, 1000), MeanOf(pixels, 0, 0, kSide), 0.51f * kLevel);
}

TEST(MipTextureLevels, BlendWithoutAJumpAsTheFootprintGrows) {
  const MipTexture texture(RandomPixels(128, 128, 4), MipTexture::Edge::kRepeat);
  for (const float u : {0.12f, 0.57f}) {
    float before = texture.Sample(u, 0.41f, 1e-4f);
    for (float footprint = 1e-4f; footprint < 3; footprint *= 1.01f) {
      const float now = texture.Sample(u, 0.41f, footprint);
      // A level's share changes by at most 2 % a step, of a difference of at most 1.
      ASSERT_NEAR(now, before, 0.025f) << footprint;
      before = now;
    }
  }
}

TEST(MipTextureEdge, RepeatsWithoutASeamAtEveryLevel) {
  constexpr int kSide = 32;
  const MipTexture texture(RandomPixels(kSide, kSide, 5), MipTexture::Edge::kRepeat);
  for (const float footprint : {0.0f, 0.05f, 0.2f, 0.7f}) {
    for (float v = -1.3f; v < 1; v += 0.11f) {
      // From the last texel's centre to the first's, and on: a texel's step is at most 1.
      constexpr float kStep = 1e-4f, kSteepest = 1.1f * kSide * kStep;
      for (float u = -1.0f / kSide; u < 1.0f / kSide; u += kStep) {
        ASSERT_NEAR(texture.Sample(u + kStep, v, footprint), texture.Sample(u, v, footprint),
                    kSteepest);
        ASSERT_NEAR(texture.Sample(v, u + kStep, footprint), texture.Sample(v, u, footprint),
                    kSteepest);
      }
      EXPECT_NEAR(texture.Sample(0.3f, v, footprint), texture.Sample(2.3f, v - 3, footprint),
                  1e-3f);
    }
  }
}

TEST(MipTextureEdge, OfAnyShapeIsReadWithinItsPixels) {
  for (const auto& [rows, cols] : {std::pair(1, 1), {1, 7}, {5, 1}, {3, 10}, {33, 17}}) {
    cv::Mat1b pixels = RandomPixels(rows, cols, 6);
    double low, high;
    cv::minMaxLoc(pixels, &low, &high);
    const MipTexture texture(pixels, MipTexture::Edge::kClamp);
    for (float footprint = 0; footprint < 4; footprint += 0.13f) {
      for (float u = -2; u < 3; u += 0.31f) {
        const float value = texture.Sample(u, 1.7f * u - 0.4f, footprint);
        ASSERT_GE(value, static_cast<float>(low) * kLevel - 1e-5f);
        ASSERT_LE(value, static_cast<float>(high) * kLevel + 1e-5f);
      }
    }
  }
}

void ExpectNoSeams(const MaterialTextures& textures) {
  for (int i = 0; i < kMaterialCount; ++i) {
    const MipTexture& tile = textures[static_cast<Material>(i)];
    constexpr int kSide = 512;
    const auto column = [](int x) { return (static_cast<float>(x) + 0.5f) / kSide; };
    // The mean difference of neighbouring columns and rows; at the seam it is no other one.
    double inside = 0, seam = 0;
    for (int y = 0; y < kSide; ++y) {
      for (const int x : {57, 113, 250, 301, 407}) {
        inside += std::abs(tile.Sample(column(x), column(y), 0) -
                           tile.Sample(column(x + 1), column(y), 0)) +
                  std::abs(tile.Sample(column(y), column(x), 0) -
                           tile.Sample(column(y), column(x + 1), 0));
      }
      seam += std::abs(tile.Sample(column(kSide - 1), column(y), 0) -
                       tile.Sample(column(kSide), column(y), 0)) +
              std::abs(tile.Sample(column(y), column(kSide - 1), 0) -
                       tile.Sample(column(y), column(kSide), 0));
    }
    // Courses have a joint there, and prints the edge of their pages.
    const bool joint = i >= static_cast<int>(Material::kConcrete);
    EXPECT_LT(seam / kSide, (joint ? 6 : 1.6) * inside / (5 * kSide) + 0.02) << i;
  }
}

TEST(MaterialTiles, FollowFromTheirSeedAndRepeatWithoutASeam) {
  const MaterialTextures textures(11), again(11);
  ExpectNoSeams(textures);
  const auto difference = [](const MipTexture& a, const MipTexture& b) {
    double sum = 0;
    for (float u = 0.01f; u < 1; u += 0.037f)
      sum += std::abs(a.Sample(u, 1.9f * u, 0) - b.Sample(u, 1.9f * u, 0));
    return sum;
  };
  for (int i = 0; i < kMaterialCount; ++i) {
    const auto material = static_cast<Material>(i);
    EXPECT_EQ(difference(textures[material], again[material]), 0);
    for (int k = 0; k < i; ++k)
      EXPECT_GT(difference(textures[material], textures[static_cast<Material>(k)]), 0.1);
  }
}

}  // namespace
}  // namespace deepuav
