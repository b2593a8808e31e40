// Which of two matchers the relocaliser asks, and for what.

#include <gmock/gmock.h>

#include "deepuav/localisation/testing/relocaliser_fixture.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

/// Counts what it is asked, and matches only what it is told to.
class CountingMatcher : public Matcher {
 public:
  explicit CountingMatcher(bool matches) : matches_(matches) {}
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    ++calls;
    return matches_ ? nearest_.MatchFeatures(a, b) : std::vector<Match>();
  }
  std::string Description() const override { return "counting"; }
  int calls = 0;

 private:
  const bool matches_;
  NearestNeighbourMatcher nearest_{{}};
};

TEST_F(RelocaliserTest, AsksTheThoroughMatcherOnlyWhereNoPoseIsSure) {
  const SyntheticView view = world_.View(Above(6, 1, 0), {0.5, 0.3, 0, 50}, &random_);
  CountingMatcher quick(true), thorough(true);
  Relocaliser relocaliser(world_.camera(), {}, {}, {&quick, &thorough}, nullptr);
  EXPECT_TRUE(relocaliser.Relocalise(FrameOf(100, view), {}, LocalMaps{around_[2]}));
  EXPECT_GT(quick.calls, 0);
  EXPECT_EQ(thorough.calls, 0);
}

TEST_F(RelocaliserTest, TheThoroughMatcherFindsWhatTheQuickOneDoesNotInTheFirstCandidates) {
  const SE3 truth = Above(6, 1, 0);
  const SyntheticView view = world_.View(truth, {0.5, 0.3, 0, 50}, &random_);
  const FeatureWorld elsewhere{Ground(7), 8};
  const SyntheticMap other =
      MakeTrueMap(elsewhere, {Above(0, 0, 0), Above(2, 0, 0)}, {0.5, 0.3, 0, 0}, &random_);
  const auto wrong = MakeLocalMap(other.map, other.keyframes[0], {});
  RelocaliserOptions options;
  options.neighbours = 0;
  for (const bool first : {true, false}) {
    CountingMatcher quick(false), thorough(true);
    Relocaliser relocaliser(world_.camera(), options, {}, {&quick, &thorough}, nullptr);
    const LocalMaps candidates =
        first ? LocalMaps{wrong, around_[2], wrong} : LocalMaps{wrong, wrong, around_[2]};
    const auto found = relocaliser.Relocalise(FrameOf(100, view), {}, candidates);
    EXPECT_EQ(quick.calls, 3);
    // A sure pose has to stand against the last one, too.
    EXPECT_EQ(thorough.calls, options.thorough_candidates + (first ? 1 : 0));
    ASSERT_EQ(found.has_value(), first);
    if (!found) continue;
    EXPECT_EQ(found->candidate, 1);
    ExpectPose(found->located.cam_from_world, truth);
  }
}

TEST_F(RelocaliserTest, TheThoroughMatcherRefusesWhereTwoPlacesFitAlike) {
  const SyntheticMap both = MapOfTwoAlike(world_, &random_);
  const auto first = MakeLocalMap(both.map, both.keyframes[1], {});
  const auto second = MakeLocalMap(both.map, both.keyframes[5], {});
  const FeatureWorld elsewhere{Ground(7), 8};
  const SyntheticMap other =
      MakeTrueMap(elsewhere, {Above(0, 0, 0), Above(2, 0, 0)}, {0.5, 0.3, 0, 0}, &random_);
  const auto wrong = MakeLocalMap(other.map, other.keyframes[0], {});
  const SyntheticView view = world_.View(Above(3, 0, 0), {0.5, 0.3, 0, 50}, &random_);
  CountingMatcher quick(false), thorough(true);
  Relocaliser relocaliser(world_.camera(), {}, {}, {&quick, &thorough}, nullptr);
  EXPECT_TRUE(relocaliser.Relocalise(FrameOf(100, view), {}, LocalMaps{first, wrong, wrong}));
  EXPECT_FALSE(relocaliser.Relocalise(FrameOf(100, view), {}, LocalMaps{first, wrong, second}));
}

/// Finds nothing in one keyframe.
class BlindMatcher : public Matcher {
 public:
  explicit BlindMatcher(const LocalMap& candidate)
      : to_(candidate.keyframes[static_cast<size_t>(candidate.centre)].features.get()) {}
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    return &b == to_ ? std::vector<Match>() : nearest_.MatchFeatures(a, b);
  }
  std::string Description() const override { return "blind"; }

 private:
  const Features* to_;
  NearestNeighbourMatcher nearest_{{}};
};

/// Many landmarks of a small object agree with a place of another map, fewer all over the image
/// with the true one.
TEST_F(RelocaliserTest, ASurePoseCountsMoreThanOneWithMoreLandmarks) {
  const SE3 truth = Above(6, 0, 0);
  const FeatureWorld elsewhere{Ground(7), 8};
  const SyntheticMap other =
      MakeTrueMap(elsewhere, {truth, Above(8, 0, 0)}, {0.5, 0.2, 0, 0}, &random_);
  auto right = std::make_shared<LocalMap>(*MakeLocalMap(other.map, other.keyframes[0], {}));
  right->map = MapId{1};
  const SyntheticView all = elsewhere.View(truth, {0.5, 0.2, 0, 0}, &random_);
  const SyntheticView object = world_.View(truth, {0.5, 0.2, 0, 0}, &random_);
  Features features(*all.features);
  features.keypoints.clear();
  features.descriptors = Descriptors(FeatureWorld::kDimension);
  const auto take = [&features](const Features& from, int i) {
    features.keypoints.push_back(from.keypoints[static_cast<size_t>(i)]);
    features.descriptors.AppendFrom(from.descriptors, i);
  };
  for (int i = 0; i < all.features->size(); i += 16) take(*all.features, i);
  const int spread = features.size();
  for (int i = 0; i < object.features->size(); ++i) {
    const Eigen::Vector2f px = object.features->keypoints[static_cast<size_t>(i)].px;
    if ((px - Eigen::Vector2f(376, 240)).cwiseAbs().maxCoeff() < 90) take(*object.features, i);
  }
  ASSERT_GT(features.size(), 2 * spread) << spread << " all over the image";
  SyntheticView view = all;
  view.features = std::make_shared<const Features>(features);

  BlindMatcher quick(*right);
  NearestNeighbourMatcher thorough({});
  RelocaliserOptions options;
  options.neighbours = 0;
  options.min_inliers = 20;
  const LocalMaps candidates = {around_[2], right};
  std::string reason;
  EXPECT_FALSE(Relocaliser(world_.camera(), options, {}, {&quick}, nullptr)
                   .Relocalise(FrameOf(100, view), {}, candidates, &reason));
  EXPECT_THAT(reason, HasSubstr("not sure"));
  const auto found = Relocaliser(world_.camera(), options, {}, {&quick, &thorough}, nullptr)
                         .Relocalise(FrameOf(100, view), {}, candidates);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->candidate, 1);
  ExpectPose(found->located.cam_from_world, truth);
}

/// The quick matcher finds an unsure pose in the last candidate: it is tried before the first.
TEST_F(RelocaliserTest, TheThoroughMatcherIsAskedForCandidatesWithAPoseFirst) {
  RelocaliserOptions options;
  options.min_inliers = 10000;  // no pose is sure
  options.neighbours = 0;
  options.thorough_candidates = 1;
  class RecordingMatcher : public Matcher {
   public:
    std::vector<Match> MatchFeatures(const Features& /*a*/, const Features& b) override {
      asked.push_back(&b);
      return {};
    }
    std::string Description() const override { return "recording"; }
    std::vector<const Features*> asked;
  };
  RecordingMatcher thorough;
  const SyntheticView view = world_.View(Above(0, 0, 0), {0.5, 0.3, 0, 50}, &random_);
  Relocaliser relocaliser(world_.camera(), options, {}, {&matcher_, &thorough}, nullptr);
  relocaliser.Relocalise(FrameOf(100, view), {}, LocalMaps{around_[7], around_[6], around_[0]});
  const LocalMap& last = *around_[0];
  ASSERT_EQ(thorough.asked.size(), 1u);
  EXPECT_EQ(thorough.asked[0], last.keyframes[static_cast<size_t>(last.centre)].features.get());
}

}  // namespace
}  // namespace deepuav
