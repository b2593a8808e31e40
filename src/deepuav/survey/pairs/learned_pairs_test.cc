#include "deepuav/survey/pairs/learned_pairs.h"

#include <gtest/gtest.h>

#include <memory>

#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr int kViews = 4, kKeypoints = 120;

/// Says that key point i is key point i, for the first so many, and counts how often it is asked.
class CountingMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features&, const Features&) override {
    ++asked;
    std::vector<Match> matches;
    for (int i = 0; i < found; ++i) matches.push_back({i, i, 1});
    return matches;
  }
  std::string Description() const override { return "counting"; }

  int found = kKeypoints, asked = 0;
};

/// Photographs of the same points, taken beside one another: any matches of equal numbers agree.
class LearnedPairsTest : public ::testing::Test {
 protected:
  LearnedPairsTest() {
    FeatureWorld world({}, 1);
    Random random(2);
    const std::vector<Eigen::Vector3d> points =
        LandmarksOnGround(kKeypoints, {-15, -12}, {15, 12}, 3, &random);
    for (int v = 0; v < kViews; ++v) {
      const SE3 pose = LookDown({2.0 * v, 1.0 * (v % 2), 40}, 0);
      auto features = std::make_shared<Features>();
      for (const Eigen::Vector3d& point : points)
        features->keypoints.push_back(KeypointAt(world.camera().pinhole.Project(pose * point)));
      SurveyView& view = views_.emplace_back();
      view.frame.features = std::move(features);
    }
    for (int a = 0; a < kViews; ++a)
      for (int b = a + 1; b < kViews; ++b) tried_.insert({a, b, 0, 0});
  }

  /// Of which so many are known, as another matcher found them.
  static MatchedPair Known(int a, int b, int matches) {
    MatchedPair pair{a, b, {}};
    for (int i = 0; i < matches; ++i) pair.matches.push_back({i, i, 1});
    return pair;
  }

  std::vector<SurveyView> views_;
  std::set<PairCandidate> tried_;
  CountingMatcher matcher_;
};

TEST_F(LearnedPairsTest, WhereMoreAgreeTheyStandInForThoseThereAre) {
  std::vector<MatchedPair> pairs = {Known(0, 3, 30), Known(0, 1, 30)};
  pairs[0].coverage = 0.5;
  LearnedPairs learned(&views_, &matcher_, {});
  EXPECT_TRUE(learned.Add(tried_, {3}, {}, &pairs, nullptr));
  ASSERT_EQ(pairs.size(), 4u) << "1 and 3, 2 and 3 are new";
  EXPECT_GT(pairs[0].matches.size(), 0.9 * kKeypoints);
  EXPECT_FALSE(pairs[0].coverage) << "that was of other matches";
  EXPECT_EQ(pairs[1].matches.size(), 30u) << "both are in the map";
}

TEST_F(LearnedPairsTest, FewerMatchesStandInForNothing) {
  matcher_.found = 40;
  std::vector<MatchedPair> pairs = {Known(0, 3, 50), Known(1, 3, 50), Known(2, 3, 50)};
  pairs[0].coverage = 0.5;
  LearnedPairs learned(&views_, &matcher_, {});
  EXPECT_FALSE(learned.Add(tried_, {3}, {}, &pairs, nullptr));
  EXPECT_EQ(matcher_.asked, 3);
  for (const MatchedPair& pair : pairs) EXPECT_EQ(pair.matches.size(), 50u);
  EXPECT_EQ(pairs[0].coverage, 0.5);
}

TEST_F(LearnedPairsTest, APairIsAskedForOnceWhateverCameOfIt) {
  for (const int found : {kKeypoints, 0}) {
    matcher_.found = found;
    matcher_.asked = 0;
    tried_.insert({0, 3, 2, 0});  // under another heading, too
    LearnedPairs learned(&views_, &matcher_, {});
    std::vector<MatchedPair> pairs, again;
    EXPECT_EQ(learned.Add(tried_, {3}, {}, &pairs, nullptr), found > 0);
    EXPECT_EQ(learned.Add(tried_, {3}, {}, &again, nullptr), found > 0);
    EXPECT_EQ(matcher_.asked, 3);
    EXPECT_EQ(again.size(), pairs.size());
  }
}

TEST_F(LearnedPairsTest, PhotographsOfOtherMapsAndWhatIsStoppedAreNotAskedFor) {
  LearnedPairs learned(&views_, &matcher_, {});
  std::vector<MatchedPair> pairs;
  EXPECT_TRUE(learned.Add(tried_, {3}, {0, 1}, &pairs, nullptr));
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].a, 2);
  matcher_.asked = 0;
  EXPECT_FALSE(learned.Add(tried_, {0}, {}, &pairs, [] { return true; }));
  EXPECT_FALSE(learned.Add(tried_, {}, {}, &pairs, nullptr));
  EXPECT_FALSE(LearnedPairs(&views_, nullptr, {}).Add(tried_, {0}, {}, &pairs, nullptr));
  EXPECT_EQ(matcher_.asked, 0);
}

}  // namespace
}  // namespace deepuav
