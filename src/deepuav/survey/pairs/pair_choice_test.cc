#include "deepuav/survey/pairs/pair_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "support/synthetic_places.h"

namespace deepuav {
namespace {

constexpr int kKeypoints = 150, kViews = 8;

/// Photographs of which each looks like itself alone, 10 m from one to the next.
class PairChoiceTest : public ::testing::Test {
 protected:
  PairChoiceTest() {
    for (int v = 0; v < kViews; ++v) {
      const auto features = std::make_shared<const Features>(
          RandomFeatures(kKeypoints, 640, 480, FeatureWorld::kDimension, &random_));
      views_.emplace_back().frame.features = features;
      looks_.push_back(features->descriptors);
    }
    vocabulary_ = VocabularyOf(looks_);
    options_.sequence_neighbours = options_.similar_neighbours = 0;
    options_.position_neighbours = 2;
  }

  void PlaceInLine() {
    for (int v = 0; v < kViews; ++v)
      views_[static_cast<size_t>(v)].position_m = Eigen::Vector3d(10.0 * v, 0, 60);
  }
  std::vector<PairCandidate> Choose() const { return ChoosePairs(views_, &*vocabulary_, options_); }

  Random random_{7};
  std::vector<SurveyView> views_;
  std::vector<Descriptors> looks_;
  std::optional<Vocabulary> vocabulary_;
  SurveyOptions options_;
};

TEST_F(PairChoiceTest, PairsThoseThatAreSaidToBeNear) {
  EXPECT_TRUE(Choose().empty()) << "no position is known";
  PlaceInLine();
  const std::vector<PairCandidate> pairs = ChoosePairs(views_, nullptr, options_);
  for (int v = 0; v + 1 < kViews; ++v)
    EXPECT_TRUE(std::ranges::count(pairs, PairCandidate{v, v + 1, 0, 0})) << v;
  EXPECT_FALSE(std::ranges::count(pairs, PairCandidate{0, kViews - 1, 0, 0}));
}

TEST_F(PairChoiceTest, UnderTheHeadingThatMakesThemMostAlike) {
  PlaceInLine();
  views_[2].turned[1] = {looks_[3], nullptr};
  views_[5].turned[0] = {looks_[4], nullptr};
  const std::vector<PairCandidate> pairs = Choose();
  EXPECT_TRUE(std::ranges::count(pairs, PairCandidate{2, 3, 2, 0})) << "turned by half";
  EXPECT_TRUE(std::ranges::count(pairs, PairCandidate{4, 5, 3, 0})) << "the second turned";
  EXPECT_FALSE(std::ranges::count(pairs, PairCandidate{4, 5, 0, 0}));
}

TEST_F(PairChoiceTest, PairsThoseThatLookAlikeWhereverTheyAre) {
  views_[6].frame.features = views_[1].frame.features;
  options_.similar_neighbours = 1;
  EXPECT_TRUE(std::ranges::count(Choose(), PairCandidate{1, 6, 0, 0}));
  PlaceInLine();
  EXPECT_TRUE(std::ranges::count(Choose(), PairCandidate{1, 6, 0, 0}));
}

TEST(ChoosePairs, OfAnOrderAloneAreTheNextFew) {
  std::vector<SurveyView> views(5);
  SurveyOptions options;
  options.sequence_neighbours = 2;
  const std::vector<PairCandidate> expected = {{0, 1, 0, 0}, {0, 2, 0, 0}, {1, 2, 0, 0},
                                               {1, 3, 0, 0}, {2, 3, 0, 0}, {2, 4, 0, 0},
                                               {3, 4, 0, 0}};
  EXPECT_EQ(ChoosePairs(views, nullptr, options), expected);
  options.sequence_neighbours = 0;
  EXPECT_TRUE(ChoosePairs(views, nullptr, options).empty());
  options.sequence_neighbours = 1000;
  EXPECT_EQ(ChoosePairs(views, nullptr, options).size(), 10u);
  EXPECT_TRUE(ChoosePairs({}, nullptr, options).empty());
}

}  // namespace
}  // namespace deepuav
