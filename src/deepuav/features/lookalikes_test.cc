#include "deepuav/features/lookalikes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "deepuav/features/superpoint.h"
#include "deepuav/features/testing/toy_superpoint.h"

namespace deepuav {
namespace {

using testing::ElementsAre;

constexpr int kDimension = 32;

/// The direction `axis`, turned towards the next one.
std::vector<float> Row(size_t axis, double turned_rad = 0) {
  std::vector<float> row(kDimension, 0.F);
  row[axis] = static_cast<float>(std::cos(turned_rad));
  row[axis + 1] = static_cast<float>(std::sin(turned_rad));
  return row;
}

class LookalikesTest : public testing::Test {
 protected:
  void Add(float x, float y, const std::vector<float>& row) {
    const auto score = 1 / static_cast<float>(2 + features_.size());
    features_.keypoints.push_back({{x, y}, {x, y}, score, 1});
    features_.descriptors.Append(row);
  }

  Features features_{{}, Descriptors(kDimension)};
};

TEST_F(LookalikesTest, AreAlikeAndApart) {
  Add(10, 10, Row(0));
  Add(100, 10, Row(0, 0.3));  // Cosine 0.955 to the first...
  Add(200, 10, Row(0, 1.0));  // ...and 0.540; 0.765 to the second.
  Add(12, 10, Row(0));        // Beside the first.
  Add(300, 10, Row(5));
  EXPECT_THAT(CountLookalikes(features_, 0.9, 16), ElementsAre(1, 2, 0, 1, 0));
  EXPECT_THAT(CountLookalikes(features_, 0.7, 16), ElementsAre(1, 3, 1, 1, 0));
  EXPECT_THAT(CountLookalikes(features_, 0.9, 1), ElementsAre(2, 2, 0, 2, 0));
}

TEST_F(LookalikesTest, AreCountedInManyKeypoints) {
  for (int i = 0; i < 300; ++i)
    Add(static_cast<float>(20 * i), 10, Row(static_cast<size_t>(i % 3)));
  const std::vector<int> lookalikes = CountLookalikes(features_, 0.9, 16);
  EXPECT_THAT(lookalikes, testing::Each(99));
  EXPECT_EQ(lookalikes.size(), 300);
}

TEST_F(LookalikesTest, OfNothingAreNone) {
  EXPECT_TRUE(CountLookalikes(features_, 0.9, 16).empty());
  EXPECT_EQ(ShareWithLookalikes({}), 0);
  EXPECT_EQ(MostDistinct(features_, {}, 10).size(), 0);
}

TEST_F(LookalikesTest, ShareCountsThoseWithAny) {
  EXPECT_EQ(ShareWithLookalikes({0, 7, 1, 0}), 0.5);
}

TEST_F(LookalikesTest, TheMostDistinctAreTheBestOfThoseWithFewest) {
  for (size_t i = 0; i < 5; ++i) Add(static_cast<float>(i), 0, Row(i));
  const Features distinct = MostDistinct(features_, {3, 0, 0, 1, 0}, 4);
  ASSERT_EQ(distinct.size(), 4);
  ASSERT_EQ(distinct.descriptors.size(), 4);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(distinct.keypoints[static_cast<size_t>(i)].image_px.x(), i + 1);
    EXPECT_NEAR(distinct.descriptors.Similarity(i, features_.descriptors, i + 1), 1, 0.01);
  }
  EXPECT_EQ(MostDistinct(features_, {3, 0, 0, 1, 0}, 2).keypoints[1].image_px.x(), 2);
  EXPECT_EQ(MostDistinct(features_, {3, 0, 0, 1, 0}, 100).size(), 5);
}

class SuperPointToyLookalikes : public testing::Test {
 protected:
  /// Rows of bright dots, and faint ones that lie otherwise in the cells of the descriptors.
  SuperPointToyLookalikes() {
    for (int x = 27; x < 124; x += 24) {
      for (int y = 11; y < 96; y += 24) image_(y, x) = 255;
    }
    for (const cv::Point& once : {cv::Point(58, 10), {101, 43}, {28, 78}}) image_(once) = 60;
    options_.model = WriteToyNetwork(testing::TempDir(), "scores");
    options_.threshold = 0.3;
    options_.subpixel = false;
    options_.keypoints = 4;
    options_.distinct_candidates = 10;
  }

  /// Of the four that are kept.
  auto BrightOnes(const SuperPointOptions& options) {
    const Camera camera = PinholeCamera(image_.cols, image_.rows);
    const Features kept = SuperPoint(camera, options, Fp32()).Extract(image_);
    EXPECT_EQ(kept.size(), 4);
    EXPECT_EQ(kept.descriptors.size(), 4);
    EXPECT_TRUE(std::ranges::is_sorted(kept.keypoints, std::greater(), &Keypoint::score));
    return std::ranges::count_if(kept.keypoints,
                                 [](const Keypoint& one) { return one.score > 0.9F; });
  }

  GreyImage image_ = GreyImage(96, 128, uint8_t{0});
  SuperPointOptions options_;
};

TEST_F(SuperPointToyLookalikes, MakeRoomForWhatOccursOnceInAPhotograph) {
  EXPECT_EQ(BrightOnes(options_), 4);
  EXPECT_EQ(BrightOnes(options_.OfPhotographs()), 1);
}

TEST_F(SuperPointToyLookalikes, StayWhereTheyMay) {
  options_.photograph_max_lookalikes = 1;
  EXPECT_EQ(BrightOnes(options_.OfPhotographs()), 4);
}

TEST_F(SuperPointToyLookalikes, StayWhereNothingFaintIsAskedFor) {
  options_.faint_keypoints = 0;
  EXPECT_EQ(BrightOnes(options_.OfPhotographs()), 4);
}

}  // namespace
}  // namespace deepuav
