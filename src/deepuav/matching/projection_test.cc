#include "deepuav/matching/projection.h"

#include <gtest/gtest.h>

#include <set>

#include "deepuav/base/error.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr int kDimension = 32;

class MatchProjectedTest : public testing::Test {
 protected:
  void AddKeypoint(const Eigen::Vector2d& px, const std::vector<float>& row) {
    features_.keypoints.push_back(KeypointAt(px));
    features_.descriptors.Append(row);
  }
  void AddTarget(const Eigen::Vector2d& px, double radius_px, const std::vector<float>& row) {
    targets_.push_back({px, radius_px, target_descriptors_.size()});
    target_descriptors_.Append(row);
  }
  std::vector<float> NewRow() { return RandomDescriptor(kDimension, &random_); }
  std::vector<float> Like(const std::vector<float>& row, double noise) {
    return NoisyDescriptor(row, noise, &random_);
  }
  std::vector<Match> Matches(const ProjectionOptions& options = {}) const {
    return MatchProjected(targets_, target_descriptors_, features_, KeypointGrid(features_),
                          options);
  }

  Random random_{1};
  Features features_{{}, Descriptors(kDimension)};
  Descriptors target_descriptors_{kDimension};
  std::vector<ProjectionTarget> targets_;
};

TEST_F(MatchProjectedTest, FindsEachTargetInItsWindow) {
  for (int i = 0; i < 400; ++i) {
    const auto row = NewRow();
    const Eigen::Vector2d px(random_.Uniform(20, 620), random_.Uniform(20, 460));
    AddKeypoint(px, Like(row, 0.3));
    AddTarget(px + Eigen::Vector2d(random_.Uniform(-5, 5), random_.Uniform(-5, 5)), 10,
              Like(row, 0.3));
  }
  const std::vector<Match> matches = Matches();
  EXPECT_GE(matches.size(), 395u);
  std::set<int> keypoints;
  for (const Match& match : matches) {
    EXPECT_EQ(match.a, match.b);
    EXPECT_TRUE(keypoints.insert(match.b).second);
  }
}

TEST_F(MatchProjectedTest, AKeypointWantedByTwoGoesToTheMoreAlike) {
  const auto row = NewRow();
  AddKeypoint({100, 100}, row);
  for (const double noise : {0.5, 0.1, 0.3}) AddTarget({101, 100}, 5, Like(row, noise));
  const std::vector<Match> matches = Matches();
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].a, 1);
  EXPECT_EQ(matches[0].b, 0);
}

TEST_F(MatchProjectedTest, LeavesAloneWhatIsOutsideTheWindow) {
  const auto row = NewRow();
  AddKeypoint({100, 100}, row);
  AddTarget({100, 106}, 5, row);
  EXPECT_TRUE(Matches().empty());
  AddTarget({100, 106}, 7, row);
  ASSERT_EQ(Matches().size(), 1u);
  EXPECT_EQ(Matches()[0].a, 1);
}

TEST_F(MatchProjectedTest, RefusesTheUnlikeAndTheAmbiguous) {
  AddKeypoint({100, 100}, NewRow());
  AddTarget({100, 100}, 5, NewRow());
  const auto row = NewRow();
  AddKeypoint({200, 100}, row);
  AddKeypoint({203, 100}, row);
  AddTarget({201, 100}, 5, Like(row, 0.3));
  EXPECT_TRUE(Matches().empty());
  EXPECT_EQ(Matches({.ratio = 1}).size(), 1u);
  // A twin outside the window does not make it ambiguous.
  AddTarget({198, 100}, 3, Like(row, 0.3));
  const std::vector<Match> matches = Matches();
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].a, 2);
  EXPECT_EQ(matches[0].b, 1);
}

TEST_F(MatchProjectedTest, OfNothingIsNothing) {
  EXPECT_TRUE(Matches().empty());
  AddTarget({10, 10}, 5, NewRow());
  EXPECT_TRUE(Matches().empty());
}

TEST_F(MatchProjectedTest, NoTargetsMatchNothing) {
  AddKeypoint({10, 10}, NewRow());
  EXPECT_TRUE(Matches().empty());
}

TEST(ProjectionOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(ProjectionOptions().Check());
  EXPECT_THROW((ProjectionOptions{.min_similarity = -2}.Check()), Error);
  EXPECT_THROW((ProjectionOptions{.ratio = 1.1}.Check()), Error);
}

}  // namespace
}  // namespace deepuav
