#include "deepuav/patches/patch_alignment.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr int kWidth = 160, kHeight = 120;

using Texture = std::function<double(const Eigen::Vector2d&)>;

/// Waves of several directions and lengths: no pattern comes twice within a patch's reach.
double Waves(const Eigen::Vector2d& p) {
  const double sum = std::sin(0.45 * p.x() + 0.11 * p.y()) +
                     std::sin(-0.17 * p.x() + 0.39 * p.y()) +
                     0.8 * std::sin(0.23 * p.x() + 0.29 * p.y() + 1) +
                     0.7 * std::sin(0.61 * p.x() - 0.34 * p.y() + 2);
  return 128 + 25 * sum;
}

/// The texture as seen through `texture_from_image`, with noise.
GreyImage Render(const Texture& texture,
                 const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& texture_from_image,
                 double noise_grey = 0, uint64_t seed = 1) {
  Random random(seed);
  GreyImage image(kHeight, kWidth);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double grey = texture(texture_from_image({u, v})) + noise_grey * random.Gaussian(1);
      image(v, u) = cv::saturate_cast<uint8_t>(grey);
    }
  }
  return image;
}

Eigen::Vector2d Same(const Eigen::Vector2d& px) { return px; }

ImagePyramid Pyramid(const GreyImage& image) { return ImagePyramid(image, 3); }

const Eigen::Vector2d kMiddle(80, 60);
const Eigen::Matrix2d kNoWarp = Eigen::Matrix2d::Identity();

class ShiftTest : public ::testing::TestWithParam<Eigen::Vector2d> {};

TEST_P(ShiftTest, IsFoundToAHundredthOfAPixel) {
  const Eigen::Vector2d shift = GetParam();
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  const ImagePyramid image =
      Pyramid(Render(Waves, [&](const Eigen::Vector2d& px) { return px - shift; }));
  const auto aligned = AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, PatchOptions{});
  ASSERT_TRUE(aligned);
  EXPECT_LT((aligned->px - kMiddle - shift).norm(), 0.02) << aligned->px.transpose();
  EXPECT_GT(aligned->correlation, 0.99);
  EXPECT_LT(aligned->noise.SigmaPx(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(SubPixel, ShiftTest,
                         ::testing::Values(Eigen::Vector2d(0, 0), Eigen::Vector2d(0.3, -0.4),
                                           Eigen::Vector2d(-0.5, 0.5), Eigen::Vector2d(1.3, 0.9),
                                           Eigen::Vector2d(-1.2, -0.9)));

TEST(PatchAlignmentTest, GainAndOffsetDoNotMatter) {
  const Eigen::Vector2d shift(0.4, -0.3);
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  const auto darker = [](const Eigen::Vector2d& p) { return 0.5 * Waves(p) + 20; };
  const ImagePyramid image =
      Pyramid(Render(darker, [&](const Eigen::Vector2d& px) { return px - shift; }));
  const auto aligned = AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, PatchOptions{});
  ASSERT_TRUE(aligned);
  EXPECT_LT((aligned->px - kMiddle - shift).norm(), 0.02);
}

/// Turned by `angle_rad` and enlarged by `scale` about the middle.
Eigen::Matrix2d Turn(double angle_rad, double scale) {
  return scale * Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
}

class WarpTest : public ::testing::TestWithParam<Eigen::Matrix2d> {};

TEST_P(WarpTest, IsFollowed) {
  const Eigen::Matrix2d image_from_reference = GetParam();
  const Eigen::Matrix2d reference_from_image = image_from_reference.inverse();
  const Eigen::Vector2d place = kMiddle + Eigen::Vector2d(3.3, -2.7);
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  const ImagePyramid image = Pyramid(Render(Waves, [&](const Eigen::Vector2d& px) {
    return kMiddle + reference_from_image * (px - place);
  }));
  const auto aligned = AlignPatch(reference, kMiddle, image_from_reference, image,
                                  place + Eigen::Vector2d(0.4, 0.5), PatchOptions{});
  ASSERT_TRUE(aligned);
  EXPECT_LT((aligned->px - place).norm(), 0.08) << (aligned->px - place).transpose();
}

INSTANTIATE_TEST_SUITE_P(Affine, WarpTest,
                         ::testing::Values(Turn(0.5, 1), Turn(std::numbers::pi / 2, 1),
                                           Turn(std::numbers::pi, 1.2), Turn(0, 2), Turn(0.2, 0.5),
                                           Turn(-0.3, 2.6),
                                           (Eigen::Matrix2d() << 1.2, 0.3, -0.1, 0.8).finished()));

TEST(PatchAlignmentTest, NoiseIsAsStated) {
  const double noise_grey = 6;
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  PatchOptions options;
  options.noise_factor = 1;
  options.min_sigma_px = 1e-3;
  double squared = 0;
  int found = 0;
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    const ImagePyramid image = Pyramid(Render(Waves, Same, noise_grey, seed));
    const auto aligned = AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, options);
    if (!aligned) continue;
    ++found;
    squared += (Whitening(aligned->noise) * Eigen::Vector2d(aligned->px - kMiddle)).squaredNorm();
  }
  ASSERT_EQ(found, 60);
  // The mean of 60 squared errors in standard deviations, each 2 on average.
  EXPECT_GT(squared / found, 1.0);
  EXPECT_LT(squared / found, 3.0);
}

TEST(PatchAlignmentTest, AnEdgeTellsOneDirectionOnly) {
  const auto edge = [](const Eigen::Vector2d& p) {
    return 128 + 90 * std::tanh((p.x() - 80) / 1.5);
  };
  const ImagePyramid reference = Pyramid(Render(edge, Same, 1, 1));
  const ImagePyramid image = Pyramid(Render(
      edge,
      [](const Eigen::Vector2d& px) -> Eigen::Vector2d { return px - Eigen::Vector2d(0.6, 0); }, 1,
      2));
  PatchOptions options;
  const auto aligned = AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, options);
  ASSERT_TRUE(aligned);
  EXPECT_NEAR(aligned->px.x(), kMiddle.x() + 0.6, 0.03);
  EXPECT_LT(std::sqrt(aligned->noise.xx), 0.1);
  // Along the edge nothing is known beyond the place where it was sought.
  EXPECT_GT(std::sqrt(aligned->noise.yy), 0.9 * options.prior_sigma_px);
}

TEST(PatchAlignmentTest, BlurWidensTheNoise) {
  const ImagePyramid reference = Pyramid(Render(Waves, Same, 2, 1));
  const auto blurred = [](const Eigen::Vector2d& p) {
    double sum = 0;
    for (int i = -4; i <= 4; ++i) sum += Waves(p + Eigen::Vector2d(i, 0.5 * i));
    return sum / 9;
  };
  PatchOptions options;
  options.min_correlation = 0.3;
  const auto sharp =
      AlignPatch(reference, kMiddle, kNoWarp, Pyramid(Render(Waves, Same, 2, 2)), kMiddle, options);
  const auto smeared = AlignPatch(reference, kMiddle, kNoWarp, Pyramid(Render(blurred, Same, 2, 2)),
                                  kMiddle, options);
  ASSERT_TRUE(sharp);
  ASSERT_TRUE(smeared);
  EXPECT_GT(smeared->noise.SigmaPx(), 1.5 * sharp->noise.SigmaPx());
}

TEST(PatchAlignmentTest, RefusesAnotherTexture) {
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  const ImagePyramid image =
      Pyramid(Render(Waves, [](const Eigen::Vector2d& px) -> Eigen::Vector2d {
        return {px.y(), 3 * px.x()};
      }));
  EXPECT_FALSE(AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, PatchOptions{}));
}

TEST(PatchAlignmentTest, RefusesTheNegative) {
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  const auto negative = [](const Eigen::Vector2d& p) { return 255 - Waves(p); };
  EXPECT_FALSE(AlignPatch(reference, kMiddle, kNoWarp, Pyramid(Render(negative, Same)), kMiddle,
                          PatchOptions{}));
}

TEST(PatchAlignmentTest, RefusesWhatHasNoContrast) {
  const auto flat = [](const Eigen::Vector2d&) { return 100.0; };
  const ImagePyramid reference = Pyramid(Render(flat, Same, 1));
  EXPECT_FALSE(AlignPatch(reference, kMiddle, kNoWarp, reference, kMiddle, PatchOptions{}));
}

// A stripe pattern repeats within reach: the alignment may go to the nearest stripe only.
TEST(PatchAlignmentTest, DoesNotRunToTheNextStripe) {
  const auto stripes = [](const Eigen::Vector2d& p) {
    return 128 + 60 * std::sin(2 * std::numbers::pi * p.x() / 8) + 20 * std::sin(0.3 * p.y());
  };
  const ImagePyramid reference = Pyramid(Render(stripes, Same));
  const ImagePyramid image =
      Pyramid(Render(stripes, [](const Eigen::Vector2d& px) -> Eigen::Vector2d {
        return px - Eigen::Vector2d(1.5, 0);
      }));
  const auto aligned = AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, PatchOptions{});
  ASSERT_TRUE(aligned);
  EXPECT_NEAR(aligned->px.x(), kMiddle.x() + 1.5, 0.05);
}

TEST(PatchAlignmentTest, RefusesWhatReachesBeyondAnImage) {
  const ImagePyramid image = Pyramid(Render(Waves, Same));
  const PatchOptions options;
  const Eigen::Vector2d corner(5, 60);
  EXPECT_FALSE(AlignPatch(image, corner, kNoWarp, image, kMiddle, options));
  EXPECT_FALSE(AlignPatch(image, kMiddle, kNoWarp, image, corner, options));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(AlignPatch(image, {nan, 60}, kNoWarp, image, kMiddle, options));
  EXPECT_FALSE(AlignPatch(image, kMiddle, kNoWarp, image, {nan, 60}, options));
  EXPECT_FALSE(AlignPatch(image, kMiddle, Eigen::Matrix2d::Zero(), image, kMiddle, options));
  EXPECT_FALSE(AlignPatch(image, kMiddle, 100 * kNoWarp, image, kMiddle, options));
}

TEST(PatchAlignmentTest, RefusesWhatIsTooFar) {
  const ImagePyramid reference = Pyramid(Render(Waves, Same));
  PatchOptions options;
  options.max_shift_px = 0.5;
  const ImagePyramid image =
      Pyramid(Render(Waves, [](const Eigen::Vector2d& px) -> Eigen::Vector2d {
        return px - Eigen::Vector2d(1, 0);
      }));
  EXPECT_FALSE(AlignPatch(reference, kMiddle, kNoWarp, image, kMiddle, options));
}

TEST(PatchOptionsTest, NamesWhatIsOutOfBounds) {
  PatchOptions options;
  options.min_correlation = 1;
  EXPECT_THAT([&] { options.Check(); },
              ::testing::ThrowsMessage<Error>(::testing::HasSubstr("patches.min_correlation")));
}

}  // namespace
}  // namespace deepuav
