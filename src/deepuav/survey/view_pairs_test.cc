#include "deepuav/survey/view_pairs.h"

#include <gtest/gtest.h>

#include <memory>

#include "deepuav/matching/nearest_neighbour.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr int kKeypoints = 80;

/// Two photographs of the same points, taken beside one another, that look nothing alike unless one
/// of them is turned.
class TurnedPairTest : public ::testing::Test {
 protected:
  TurnedPairTest() {
    Random random(5);
    views_.resize(2);
    auto a = std::make_shared<Features>(
        RandomFeatures(kKeypoints, 640, 480, FeatureWorld::kDimension, &random));
    auto b = std::make_shared<Features>(
        RandomFeatures(kKeypoints, 640, 480, FeatureWorld::kDimension, &random));
    for (size_t i = 0; i < a->keypoints.size(); ++i) {
      b->keypoints[i] = a->keypoints[i];
      b->keypoints[i].image_px.x() += static_cast<float>(random.Uniform(20, 80));
    }
    views_[0].frame.features = std::move(a);
    views_[1].frame.features = std::move(b);
  }

  const Descriptors& DescriptorsOf(size_t view) const {
    return views_[view].frame.features->descriptors;
  }

  size_t MatchesOf(int quarter_turns) {
    PairMatching matching(&views_, &matcher_, nullptr, SurveyOptions());
    const auto pairs = matching.Match({{0, 1, quarter_turns}}, nullptr);
    return pairs.empty() ? 0 : pairs.front().matches.size();
  }

  std::vector<SurveyView> views_;
  NearestNeighbourMatcher matcher_{{}};
};

TEST_F(TurnedPairTest, UprightNothingMatches) {
  EXPECT_EQ(MatchesOf(0), 0u);
  EXPECT_EQ(MatchesOf(1), 0u) << "described under no other heading";
}

TEST_F(TurnedPairTest, TheFirstMayBeTurned) {
  views_[0].turned[0] = {DescriptorsOf(1), nullptr};
  EXPECT_GT(MatchesOf(1), kKeypoints / 2);
  EXPECT_EQ(MatchesOf(3), 0u);
}

TEST_F(TurnedPairTest, OrTheSecondBack) {
  TemporaryFile file;
  views_[1].turned[0] = {DescriptorsOf(0), &file};
  EXPECT_GT(MatchesOf(3), kKeypoints / 2);
  EXPECT_EQ(MatchesOf(1), 0u);
}

}  // namespace
}  // namespace deepuav
