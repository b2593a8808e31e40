#include "deepuav/features/image_region.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

Features FeaturesAt(const std::vector<Eigen::Vector2f>& pixels) {
  Features features;
  features.descriptors = Descriptors(4);
  for (size_t i = 0; i < pixels.size(); ++i) {
    features.keypoints.push_back({pixels[i], pixels[i], 1, 1});
    std::vector<float> row(4, 0.f);
    row[i % 4] = 1;
    features.descriptors.Append(row);
  }
  return features;
}

TEST(ImageRegion, CoversTheCellsThatWereAdded) {
  ImageRegion region(100, 50, 8);
  EXPECT_EQ(region.columns(), 13);
  EXPECT_EQ(region.rows(), 7);
  EXPECT_TRUE(region.empty());
  EXPECT_FALSE(region.Covers({17, 9}));
  region.Add(region.CellOf({17, 9}));
  EXPECT_TRUE(region.Covers({16, 8}));
  EXPECT_TRUE(region.Covers({23.9f, 15.9f}));
  EXPECT_FALSE(region.Covers({24, 9}));
  EXPECT_FALSE(region.empty());
  EXPECT_NEAR(region.Share(), 1. / (13 * 7), 1e-12);
}

TEST(ImageRegion, ReachesOverNeighboursButNotOverTheImagesEdge) {
  ImageRegion region(100, 50, 8);
  region.AddAround(region.CellOf({0, 0}));
  EXPECT_NEAR(region.Share(), 4. / (13 * 7), 1e-12);
  EXPECT_TRUE(region.Covers({15, 15}));
  region.AddAround(region.CellOf({99, 49}));
  EXPECT_NEAR(region.Share(), 8. / (13 * 7), 1e-12);
  EXPECT_TRUE(region.Covers({-3, -3})) << "of a pixel beyond the edge the nearest cell tells";
  EXPECT_TRUE(region.Covers({200, 90}));
}

TEST(ImageRegion, OfNoImageCoversNothing) {
  const ImageRegion none;
  EXPECT_FALSE(none.Covers({3, 3}));
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.Share(), 0);
}

TEST(ImageRegion, KnowsWhetherItHasGrown) {
  const ImageRegion none;
  ImageRegion before(64, 64, 8), after(64, 64, 8);
  EXPECT_FALSE(after.HasMoreThan(none));
  after.Add(3);
  EXPECT_TRUE(after.HasMoreThan(none));
  EXPECT_TRUE(after.HasMoreThan(before));
  before.Add(3);
  before.Add(4);
  EXPECT_FALSE(after.HasMoreThan(before));
}

TEST(ImageRegion, FeaturesOutsideKeepTheirOrderAndDescriptors) {
  ImageRegion region(100, 50, 8);
  region.Add(region.CellOf({20, 20}));
  const auto features =
      std::make_shared<const Features>(FeaturesAt({{50, 10}, {20, 20}, {60, 30}, {18, 22}}));
  const auto outside = Outside(region, features);
  ASSERT_EQ(outside->size(), 2);
  EXPECT_EQ(outside->keypoints[0].image_px.x(), 50);
  EXPECT_EQ(outside->keypoints[1].image_px.x(), 60);
  EXPECT_NEAR(outside->descriptors.Similarity(0, features->descriptors, 0), 1, 0.01);
  EXPECT_NEAR(outside->descriptors.Similarity(1, features->descriptors, 2), 1, 0.01);
  EXPECT_EQ(Outside(ImageRegion(100, 50, 8), features), features);
  EXPECT_EQ(Outside(ImageRegion(), features), features);
}

}  // namespace
}  // namespace deepuav
