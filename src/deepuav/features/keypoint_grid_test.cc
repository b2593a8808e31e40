#include "deepuav/features/keypoint_grid.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

Features FeaturesAt(const std::vector<Eigen::Vector2f>& pixels) {
  Features features;
  for (const Eigen::Vector2f& px : pixels) {
    features.keypoints.emplace_back();
    features.keypoints.back().px = px;
  }
  return features;
}

Features RandomKeypoints(int count, double low, double high, Random* random) {
  std::vector<Eigen::Vector2f> pixels;
  for (int i = 0; i < count; ++i) {
    pixels.push_back(
        Eigen::Vector2d(random->Uniform(low, high), random->Uniform(low, high)).cast<float>());
  }
  return FeaturesAt(pixels);
}

std::vector<int> BruteForce(const Features& features, const Eigen::Vector2d& px, double radius_px) {
  std::vector<int> found;
  for (int i = 0; i < features.size(); ++i) {
    const Eigen::Vector2f offset = features.keypoints[static_cast<size_t>(i)].px - px.cast<float>();
    const auto radius = static_cast<float>(radius_px);
    if (offset.squaredNorm() <= radius * radius) found.push_back(i);
  }
  return found;
}

std::vector<int> FindSorted(const KeypointGrid& grid, const Eigen::Vector2d& px, double radius_px) {
  std::vector<int> found = {-1};
  grid.Find(px, radius_px, &found);
  std::sort(found.begin(), found.end());
  return found;
}

TEST(KeypointGrid, StandsKeypointsFarOffAnyImage) {
  for (const float far : {700000.0f, 1048576.0f, 1e20f}) {
    const Features features = FeaturesAt({{0, 0}, {far, far}, {0, 0.6f * far}, {5, 5}});
    const KeypointGrid grid(features);
    EXPECT_EQ(FindSorted(grid, {0, 0}, 10), (std::vector<int>{0, 3}));
    EXPECT_EQ(FindSorted(grid, {far, far}, 1), (std::vector<int>{1}));
    EXPECT_EQ(FindSorted(grid, {0, 0.6f * far}, 1), (std::vector<int>{2}));
  }
}

TEST(KeypointGrid, FindsWhatBruteForceFinds) {
  Random random(1);
  size_t total = 0;
  for (const double low : {0.0, -700.0, 300.5}) {  // undistorted pixels may lie outside the image
    const Features features = RandomKeypoints(700, low, 1000, &random);
    const KeypointGrid grid(features);
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector2d px(random.Uniform(low - 100, 1100), random.Uniform(low - 100, 1100));
      const double radius_px = random.Uniform(0, 80);
      const std::vector<int> expected = BruteForce(features, px, radius_px);
      ASSERT_EQ(FindSorted(grid, px, radius_px), expected) << px.transpose() << " " << radius_px;
      total += expected.size();
    }
  }
  EXPECT_GT(total, 10000u);
}

TEST(KeypointGrid, FindsPointsOnTheEdgeOfCellsAndWindow) {
  std::vector<Eigen::Vector2f> pixels;
  for (int y = -32; y <= 96; y += 8) {
    for (int x = -32; x <= 96; x += 8) pixels.emplace_back(x, y);
  }
  const Features features = FeaturesAt(pixels);
  const KeypointGrid grid(features);
  for (int y = -48; y <= 112; y += 4) {
    for (int x = -48; x <= 112; x += 4) {
      for (const double radius_px : {0.0, 4.0, 8.0, 16.0, 24.0}) {
        ASSERT_EQ(FindSorted(grid, {x, y}, radius_px), BruteForce(features, {x, y}, radius_px));
      }
    }
  }
}

TEST(KeypointGrid, FindsNothingFarAwayAndAllInAWindowAroundEverything) {
  Random random(2);
  const Features features = RandomKeypoints(100, 0, 500, &random);
  const KeypointGrid grid(features);
  for (const Eigen::Vector2d& px :
       {Eigen::Vector2d(1e5, 250), Eigen::Vector2d(250, -1e5), Eigen::Vector2d(-1e12, 1e12)}) {
    EXPECT_TRUE(FindSorted(grid, px, 50).empty());
  }
  EXPECT_EQ(FindSorted(grid, {250, 250}, 1e4).size(), 100u);
  EXPECT_EQ(FindSorted(grid, {250, 250}, 1e12).size(), 100u);
}

TEST(KeypointGrid, OfNoPointsAndOfOne) {
  const Features none;
  EXPECT_TRUE(FindSorted(KeypointGrid(none), {10, 10}, 1000).empty());
  const Features one = FeaturesAt({{-5, 700}});
  const KeypointGrid grid(one);
  EXPECT_EQ(FindSorted(grid, {-4, 699}, 2), std::vector<int>{0});
  EXPECT_TRUE(FindSorted(grid, {0, 0}, 2).empty());
}

TEST(KeypointGrid, OfPointsAllAtOnePlace) {
  const Features features = FeaturesAt(std::vector<Eigen::Vector2f>(50, {33, 44}));
  const KeypointGrid grid(features);
  EXPECT_EQ(FindSorted(grid, {33, 44}, 0).size(), 50u);
  EXPECT_TRUE(FindSorted(grid, {34, 44}, 0.5).empty());
}

TEST(KeypointGrid, GivesTheSameOrderEveryTime) {
  Random random(3);
  const Features features = RandomKeypoints(300, 0, 200, &random);
  std::vector<int> first, second;
  KeypointGrid(features).Find({100, 100}, 60, &first);
  KeypointGrid(features).Find({100, 100}, 60, &second);
  EXPECT_GT(first.size(), 20u);
  EXPECT_EQ(first, second);
}

}  // namespace
}  // namespace deepuav
