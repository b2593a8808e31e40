#include "deepuav/localisation/relocaliser.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/localisation/testing/relocaliser_fixture.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

TEST_F(RelocaliserTest, FindsThePoseDespiteFortyPercentWrongDescriptors) {
  const SE3 truth = Above(6, 1, 20);
  const SyntheticView view = world_.View(truth, {0.5, 0.3, 0.4, 50}, &random_);
  const auto found = Relocalise(view, {around_[2]});
  ASSERT_TRUE(found) << reason_;
  ExpectPose(found->located.cam_from_world, truth);
  EXPECT_EQ(found->candidate, 0);
  EXPECT_EQ(found->quarter_turns, 0);
  EXPECT_EQ(found->evidence.inliers, static_cast<int>(found->located.seen.size()));
  EXPECT_EQ(found->evidence.visible, static_cast<int>(found->located.visible.size()));
  int wrong = 0;
  for (const LocatedFrame::Seen& seen : found->located.seen) {
    const int shown = view.landmark[static_cast<size_t>(seen.keypoint)];
    const LandmarkId id = around_[2]->landmarks[static_cast<size_t>(seen.landmark)].id;
    wrong += shown < 0 || made_->landmark_of[static_cast<size_t>(shown)] != id;
  }
  EXPECT_LE(wrong, found->evidence.inliers / 50);
}

TEST_F(RelocaliserTest, FindsThePoseAtAllQuarterTurns) {
  for (int turns = 1; turns < 4; ++turns) {
    const SE3 truth = Above(8, 1, 90 * turns + 10);
    SyntheticView view = world_.View(truth, {0.5, 0.3, 0.2, 50}, &random_);
    const std::vector<Descriptors> turned = TurnedOf(*view.features, turns, &random_);
    view.features = std::make_shared<const Features>(
        Features{view.features->keypoints,
                 RandomFeatures(view.features->size(), 10, 10, FeatureWorld::kDimension, &random_)
                     .descriptors});
    EXPECT_FALSE(Relocalise(view, {around_[0]})) << "upright nothing can match";
    const auto found = Relocalise(view, {around_[0]}, turned);
    ASSERT_TRUE(found) << turns << ": " << reason_;
    EXPECT_EQ(found->quarter_turns, turns);
    ExpectPose(found->located.cam_from_world, truth);
    EXPECT_GT(found->evidence.inliers, found->evidence.agreeing * 6 / 5)
        << "what the candidate's keyframe does not see is matched turned as well";
    std::vector<Descriptors> alone(turned.size());
    alone[static_cast<size_t>(turns - 1)] = turned[static_cast<size_t>(turns - 1)];
    const auto found_alone = Relocalise(view, {around_[0]}, alone);
    ASSERT_TRUE(found_alone) << turns << ", the only heading described: " << reason_;
    EXPECT_EQ(found_alone->located.cam_from_world.Matrix(), found->located.cam_from_world.Matrix());
  }
}

TEST_F(RelocaliserTest, TellsTheMatcherPositionsAsOnTheTurnedImage) {
  /// Notes where the first key point is.
  class NotingMatcher : public Matcher {
   public:
    std::vector<Match> MatchFeatures(const Features& a, const Features& /*b*/) override {
      positions.push_back(a.keypoints.front().image_px);
      return {};
    }
    std::string Description() const override { return "noting"; }
    std::vector<Eigen::Vector2f> positions;
  };
  SyntheticView view;
  Features features{{KeypointAt({700, 100})}, Descriptors(FeatureWorld::kDimension)};
  features.descriptors.Append(RandomDescriptor(FeatureWorld::kDimension, &random_));
  view.features = std::make_shared<const Features>(features);
  NotingMatcher noting;
  RelocaliserOptions options;
  options.neighbours = 0;
  Relocaliser relocaliser(world_.camera(), options, {}, {&noting}, nullptr);
  relocaliser.Relocalise(FrameOf(0, view), TurnedOf(features, 1, &random_), LocalMaps{around_[0]});
  ASSERT_EQ(noting.positions.size(), 4u);
  // 324 right of the centre (376, 240) and 140 above it.
  EXPECT_EQ(noting.positions[0], Eigen::Vector2f(700, 100));
  EXPECT_LT((noting.positions[1] - Eigen::Vector2f(376 + 140, 240 + 324)).norm(), 1.5);
  EXPECT_LT((noting.positions[2] - Eigen::Vector2f(376 - 324, 240 + 140)).norm(), 1.5);
  EXPECT_LT((noting.positions[3] - Eigen::Vector2f(376 - 140, 240 - 324)).norm(), 1.5);
}

TEST_F(RelocaliserTest, PicksTheCandidateThatShowsThePlace) {
  const FeatureWorld elsewhere{Ground(7), 8};
  const SyntheticMap other =
      MakeTrueMap(elsewhere, {Above(0, 0, 0), Above(2, 0, 0)}, {0.5, 0.3, 0, 0}, &random_);
  const LocalMaps candidates = {MakeLocalMap(other.map, other.keyframes[0], {}), around_[6]};
  const SE3 truth = Above(14, -1, 0);
  const auto found = Relocalise(world_.View(truth, {0.5, 0.3, 0, 50}, &random_), candidates);
  ASSERT_TRUE(found) << reason_;
  EXPECT_EQ(found->candidate, 1);
  ExpectPose(found->located.cam_from_world, truth);
}

TEST_F(RelocaliserTest, TakesOverlappingCandidatesForOnePlace) {
  const SE3 truth = Above(6, 0, 0);
  const auto found = Relocalise(world_.View(truth, {0.5, 0.3, 0, 50}, &random_),
                                {around_[1], around_[2], around_[3]});
  ASSERT_TRUE(found) << reason_;
  ExpectPose(found->located.cam_from_world, truth);
}

TEST_F(RelocaliserTest, RefusesOtherPlaces) {
  const FeatureWorld elsewhere{Ground(7), 8};
  for (double x : {0, 6, 12}) {
    const SyntheticView view = elsewhere.View(Above(x, 0, 0), {0.5, 0.3, 0, 50}, &random_);
    EXPECT_FALSE(Relocalise(view, around_, TurnedOf(*view.features, 2, &random_)));
    EXPECT_EQ(reason_, "no pose in 8 candidates");
  }
}

TEST_F(RelocaliserTest, RefusesWhereTooFewAgree) {
  const SyntheticView full = world_.View(Above(6, 0, 0), {0.5, 0.2, 0, 0}, &random_);
  SyntheticView few;
  Features features{{}, Descriptors(FeatureWorld::kDimension)};
  for (int i = 0; i < full.features->size() && features.size() < 25; ++i) {
    features.keypoints.push_back(full.features->keypoints[static_cast<size_t>(i)]);
    features.descriptors.AppendFrom(full.features->descriptors, i);
  }
  few.features = std::make_shared<const Features>(features);
  EXPECT_FALSE(Relocalise(few, {around_[2]}));
  EXPECT_THAT(reason_, HasSubstr("not sure"));

  SyntheticView none;
  none.features =
      std::make_shared<const Features>(Features{{}, Descriptors(FeatureWorld::kDimension)});
  EXPECT_FALSE(Relocalise(none, {around_[2]}));
  EXPECT_EQ(reason_, "no pose in 1 candidates");
  EXPECT_FALSE(Relocalise(full, {}));
  EXPECT_EQ(reason_, "no pose in 0 candidates");
}

/// A small object that occurs at two places: all else differs.
TEST_F(RelocaliserTest, RefusesASmallRepeatedObject) {
  const SyntheticView place = world_.View(Above(6, 0, 0), {0.5, 0.2, 0, 0}, &random_);
  const FeatureWorld elsewhere{Ground(7), 8};
  SyntheticView view = elsewhere.View(Above(6, 0, 0), {0.5, 0.2, 0, 0}, &random_);
  Features features = *view.features;
  int of_object = 0;
  for (int i = 0; i < place.features->size(); ++i) {
    const Keypoint& keypoint = place.features->keypoints[static_cast<size_t>(i)];
    const Eigen::Vector2f from_middle = keypoint.px - Eigen::Vector2f(376, 240);
    if (from_middle.cwiseAbs().maxCoeff() > 90) continue;
    features.keypoints.push_back(keypoint);
    features.descriptors.AppendFrom(place.features->descriptors, i);
    ++of_object;
  }
  ASSERT_GT(of_object, 35);
  view.features = std::make_shared<const Features>(features);
  EXPECT_FALSE(Relocalise(view, {around_[2]}));
  EXPECT_THAT(reason_, HasSubstr("not sure"));

  RelocaliserOptions anywhere;
  anywhere.min_cells = 1;
  EXPECT_TRUE(Relocaliser(world_.camera(), anywhere, {}, {&matcher_}, nullptr)
                  .Relocalise(FrameOf(100, view), {}, LocalMaps{around_[2]}))
      << "only how little of the image it covers speaks against it";
}

TEST_F(RelocaliserTest, RefusesWhereTwoPlacesFitAlike) {
  const SyntheticMap both = MapOfTwoAlike(world_, &random_);
  const auto first = MakeLocalMap(both.map, both.keyframes[1], {});
  const auto second = MakeLocalMap(both.map, both.keyframes[5], {});
  const SE3 truth = Above(3, 0, 0);
  const SyntheticView view = world_.View(truth, {0.5, 0.3, 0, 50}, &random_);
  const auto alone = Relocalise(view, {first});
  ASSERT_TRUE(alone) << reason_;
  ExpectPose(alone->located.cam_from_world, truth);
  EXPECT_FALSE(Relocalise(view, {first, second}));
  EXPECT_THAT(reason_, HasSubstr("two places fit"));
  EXPECT_FALSE(Relocalise(view, {second, first}));
}

/// Landmarks behind the camera project into its image, too, where one forgets to look.
TEST_F(RelocaliserTest, SeesNothingBehindTheCamera) {
  const SE3 truth = Above(6, 0, 0);
  auto mirrored = std::make_shared<LocalMap>(*around_[2]);
  for (LocalLandmark& landmark : mirrored->landmarks) {
    // Through the camera's centre: on the same ray, behind.
    landmark.position_world = 2 * truth.InverseTranslation() - landmark.position_world;
    landmark.mean_view_direction = -landmark.mean_view_direction;
  }
  ASSERT_GT(mirrored->landmarks.size(), 100u);
  EXPECT_FALSE(Relocalise(world_.View(truth, {0.5, 0.2, 0, 0}, &random_), {mirrored}));
}

TEST_F(RelocaliserTest, GivesTheSameTwice) {
  const SyntheticView view = world_.View(Above(6, 1, 30), {0.5, 0.3, 0.4, 50}, &random_);
  const LocalMaps candidates = {around_[1], around_[3]};
  const auto first = Relocalise(view, candidates), second = Relocalise(view, candidates);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->located.cam_from_world.Matrix(), second->located.cam_from_world.Matrix());
  EXPECT_EQ(first->evidence.inliers, second->evidence.inliers);
  EXPECT_EQ(first->candidate, second->candidate);
}

TEST_F(RelocaliserTest, TurnedDescriptorsMustFitTheFrame) {
  const SyntheticView view = world_.View(Above(6, 0, 0), {0.5, 0.2, 0, 0}, &random_);
  EXPECT_THROW(Relocalise(view, around_, std::vector<Descriptors>(2, view.features->descriptors)),
               Error);
  std::vector<Descriptors> one_too_few(3);
  one_too_few[1] = Descriptors(FeatureWorld::kDimension);
  for (int i = 1; i < view.features->size(); ++i)
    one_too_few[1].AppendFrom(view.features->descriptors, i);
  EXPECT_THROW(Relocalise(view, around_, one_too_few), Error);
}

TEST(RelocaliserOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(RelocaliserOptions().Check());
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::neighbours, -1).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::thorough_candidates, -1).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::min_matches, 3).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::search_radius_px, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::min_inliers, 5).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::min_inlier_ratio, 1).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::cells_per_side, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::min_cells, 65).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::rival_ratio, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::rival_distance, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&RelocaliserOptions::rival_angle_deg, 0).Check(), Error);
  RelocaliserOptions inner;
  inner.absolute_pose.min_inliers = 3;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
