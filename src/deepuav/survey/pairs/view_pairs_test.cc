#include "deepuav/survey/pairs/view_pairs.h"

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

/// Says what it was told to.
class SayingMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features&, const Features&) override { return matches; }
  std::string Description() const override { return "saying"; }

  std::vector<Match> matches;
};

/// Two photographs of which the second shows ground that the first does, key point by key point;
/// beside those, key points anywhere.
class VerifiedPairTest : public ::testing::Test {
 protected:
  static constexpr int kShown = 200, kAnywhere = 200;

  VerifiedPairTest() {
    const SyntheticWorld world;
    Random random(6);
    const auto points = LandmarksOnGround(kShown, {-15, -12}, {15, 12}, 3, &random);
    for (const double x : {0.0, 4.0}) {
      const SE3 pose = Perturbed(LookDown({x, 0, 40}, 0), 0, 0.1, &random);
      auto features = std::make_shared<Features>(
          RandomFeatures(kAnywhere, world.width, world.height, FeatureWorld::kDimension, &random));
      for (const Eigen::Vector3d& point : points)
        features->keypoints.push_back(KeypointAt(world.pinhole.Project(pose * point)));
      views_.emplace_back().frame.features = std::move(features);
    }
  }

  /// So many of each kind.
  std::vector<Match> MatchesOf(int shown, int anywhere) const {
    std::vector<Match> matches;
    for (int i = 0; i < anywhere; ++i) matches.push_back({i, i, 1});
    for (int i = 0; i < shown; ++i) matches.push_back({kAnywhere + i, kAnywhere + i, 1});
    return matches;
  }

  std::vector<MatchedPair> Verified(const std::vector<Match>& matches,
                                    const SurveyOptions& options = {}) {
    SayingMatcher matcher;
    matcher.matches = matches;
    return PairMatching(&views_, &matcher, nullptr, options).Match({{0, 1, 0, 0}}, nullptr);
  }

  std::vector<SurveyView> views_;
};

TEST_F(VerifiedPairTest, WrongMatchesAreTakenOut) {
  const auto pairs = Verified(MatchesOf(kShown, kShown / 2));
  ASSERT_EQ(pairs.size(), 1u);
  int wrong = 0, right = 0;
  for (const Match& match : pairs.front().matches) ++(match.a < kAnywhere ? wrong : right);
  EXPECT_GT(right, 0.95 * kShown);
  EXPECT_LT(wrong, 0.1 * kShown / 2) << "those that lie on their lines by chance";
}

TEST_F(VerifiedPairTest, MatchesAtRandomShowNoCommonGround) {
  EXPECT_TRUE(Verified(MatchesOf(0, kAnywhere)).empty());
  EXPECT_TRUE(Verified({}).empty());
}

TEST_F(VerifiedPairTest, SoManyMustAgreeAndSuchAShare) {
  SurveyOptions options;
  options.min_pair_matches = 50;
  options.min_pair_ratio = 0.6;
  EXPECT_FALSE(Verified(MatchesOf(60, 0), options).empty());
  EXPECT_TRUE(Verified(MatchesOf(40, 0), options).empty());
  EXPECT_FALSE(Verified(MatchesOf(80, 20), options).empty());
  EXPECT_TRUE(Verified(MatchesOf(80, 80), options).empty());
}

TEST_F(VerifiedPairTest, KeyPointsOnALineOrAtOnePlaceEndNoSurvey) {
  for (const float step_px : {0.0f, 3.0f}) {  // as of a wire, or of one light
    for (SurveyView& view : views_) {
      auto features = std::make_shared<Features>(*view.frame.features);
      for (int i = 0; i < features->size(); ++i)
        features->keypoints[static_cast<size_t>(i)].image_px =
            Eigen::Vector2f(10 + step_px * static_cast<float>(i % kShown), 100);
      view.frame.features = std::move(features);
    }
    EXPECT_NO_THROW(Verified(MatchesOf(kShown, 0))) << step_px;
  }
}

}  // namespace
}  // namespace deepuav
