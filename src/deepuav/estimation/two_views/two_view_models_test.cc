#include "deepuav/estimation/two_views/two_view_models.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

const Pinhole kPinhole{450, 440, 376, 240};
const SE3 kBFromA(RotationExp({0.05, -0.1, 0.03}), {-0.8, 0.1, 0.2});

/// Pairs of points of a box, or of a plane askew, with noise.
std::vector<PixelPair> Pairs(bool plane, double noise_px, uint64_t seed) {
  Random random(seed);
  std::vector<PixelPair> pairs;
  while (pairs.size() < 200) {
    const double x = random.Uniform(-4, 4), y = random.Uniform(-3, 3);
    const Eigen::Vector3d a(x, y, plane ? 8 + 0.4 * x - 0.2 * y : random.Uniform(5, 14));
    const Eigen::Vector3d b = kBFromA * a;
    const Eigen::Vector2d noise(random.Gaussian(noise_px), random.Gaussian(noise_px));
    pairs.push_back({kPinhole.Project(a), kPinhole.Project(b) + noise});
  }
  return pairs;
}

/// Of the pose nearest to the truth: the larger of the angles of rotation and of the baseline.
double BestErrorDeg(const TwoViewModel& model) {
  double best = std::numeric_limits<double>::infinity();
  for (const SE3& pose : model.b_from_a) {
    const double rotation = (pose * kBFromA.Inverse()).Angle();
    const double cosine = pose.translation().normalized().dot(kBFromA.translation().normalized());
    best = std::min(best, std::max(rotation, std::acos(std::clamp(cosine, -1.0, 1.0))));
  }
  return best * 180 / M_PI;
}

TEST(EstimateEssential, DecomposesIntoTheTruthAmongOthers) {
  const auto model = EstimateEssential(kPinhole, Pairs(false, 0.3, 1), 1, {});
  ASSERT_TRUE(model);
  EXPECT_LT(BestErrorDeg(*model), 3) << "not refined yet";
  for (const SE3& pose : model->b_from_a) EXPECT_NEAR(pose.translation().norm(), 1, 1e-9);
}

TEST(EstimateEssential, ItsMatrixHoldsForEveryTruePair) {
  const std::vector<PixelPair> pairs = Pairs(false, 0, 2);
  const auto model = EstimateEssential(kPinhole, pairs, 1, {});
  ASSERT_TRUE(model);
  for (const PixelPair& pair : pairs) {
    const Eigen::Vector3d line = model->matrix * pair.a_px.homogeneous();
    EXPECT_LT(std::abs(pair.b_px.homogeneous().dot(line)) / line.head<2>().norm(), 0.05);
  }
  EXPECT_EQ(std::count(model->inlier.begin(), model->inlier.end(), 1),
            static_cast<std::ptrdiff_t>(pairs.size()));
}

TEST(EstimateHomography, OfAPlaneDecomposesIntoTheTruthAmongOthers) {
  const std::vector<PixelPair> pairs = Pairs(true, 0.2, 3);
  const auto model = EstimateHomography(kPinhole, pairs, 1, {});
  ASSERT_TRUE(model);
  EXPECT_LT(BestErrorDeg(*model), 1.5);
  for (const PixelPair& pair : pairs) {
    const Eigen::Vector2d there = (model->matrix * pair.a_px.homogeneous()).hnormalized();
    EXPECT_LT((there - pair.b_px).norm(), 3);
  }
}

TEST(TwoViewModels, OutliersAreNoInliers) {
  for (const bool plane : {false, true}) {
    std::vector<PixelPair> pairs = Pairs(plane, 0.2, 4);
    constexpr size_t kWrong = 40;
    Random random(5);
    for (size_t i = 0; i < kWrong; ++i)
      pairs[i].b_px += Eigen::Vector2d(random.Uniform(30, 90), random.Uniform(30, 90));
    const auto model = plane ? EstimateHomography(kPinhole, pairs, 1, {})
                             : EstimateEssential(kPinhole, pairs, 1, {});
    ASSERT_TRUE(model);
    ASSERT_EQ(model->inlier.size(), pairs.size());
    const auto wrong = model->inlier.begin() + kWrong;
    // An epipolar line passes by chance through some.
    EXPECT_LT(std::count(model->inlier.begin(), wrong, 1), plane ? 1 : 8);
    EXPECT_GT(std::count(wrong, model->inlier.end(), 1), 140);
  }
}

TEST(TwoViewModels, PairsThatAreNotFiniteAreLeftOut) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Finite({{1, kNan}, {1, 1}}));
  EXPECT_FALSE(Finite({{1, 1}, {std::numeric_limits<double>::infinity(), 1}}));
  EXPECT_TRUE(Finite({{1, 1}, {1, 1}}));
  std::vector<PixelPair> pairs = Pairs(false, 0.2, 6);
  for (size_t i = 0; i < 20; ++i) pairs[i].a_px.x() = kNan;
  const auto model = EstimateEssential(kPinhole, pairs, 1, {});
  ASSERT_TRUE(model);
  EXPECT_LT(BestErrorDeg(*model), 3) << "not refined yet";
  for (size_t i = 0; i < 20; ++i) EXPECT_EQ(model->inlier[i], 0);
}

TEST(TwoViewModels, NothingOfTooFew) {
  std::vector<PixelPair> pairs = Pairs(false, 0, 7);
  pairs.resize(3);
  EXPECT_FALSE(EstimateEssential(kPinhole, pairs, 1, {}));
  EXPECT_FALSE(EstimateHomography(kPinhole, pairs, 1, {}));
  EXPECT_FALSE(EstimateHomography(kPinhole, {}, 1, {}));
}

TEST(TwoViewModels, TheModelThatFitsScoresHigher) {
  for (const bool plane : {false, true}) {
    const std::vector<PixelPair> pairs = Pairs(plane, 0.3, 8);
    const auto homography = EstimateHomography(kPinhole, pairs, 1, {});
    const auto essential = EstimateEssential(kPinhole, pairs, 1, {});
    ASSERT_TRUE(homography);
    if (!plane) {
      ASSERT_TRUE(essential);
      EXPECT_GT(essential->score, 2 * homography->score);
    } else if (essential) {
      EXPECT_GT(homography->score, 0.4 * essential->score);
    }
  }
}

}  // namespace
}  // namespace deepuav
