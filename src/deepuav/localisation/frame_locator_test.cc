#include "deepuav/localisation/frame_locator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/map/frame_motion.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/options_with.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

/// Counts how often the reference was matched.
class CountingMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    ++calls;
    return matcher_.MatchFeatures(a, b);
  }
  std::string Description() const override { return "counting"; }
  int calls = 0;

 private:
  NearestNeighbourMatcher matcher_{{}};
};

/// A map of six keyframes that move sideways past a box of landmarks.
class FrameLocatorTest : public testing::Test {
 protected:
  FrameLocatorTest() {
    std::vector<SE3> poses;
    for (int i = 0; i < 6; ++i) poses.push_back(At({0.5 * i, 0, 0}));
    made_.emplace(MakeTrueMap(world_, poses, {0.5, 0.3, 0, 30}, &random_));
    local_map_ = MakeLocalMap(made_->map, made_->keyframes[5], {});
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(700, {-8, -5, 6}, {10, 5, 20}, &random);
    return FeatureWorld(geometry, 2);
  }

  LocationPrior PriorAt(const SE3& cam_from_world) const {
    LocationPrior prior;
    prior.cam_from_world = cam_from_world;
    prior.reference = made_->keyframes[5];
    for (LandmarkId id : made_->map.At(made_->keyframes[5]).landmarks) {
      if (id.valid()) prior.landmarks.push_back(id);
    }
    return prior;
  }

  std::optional<LocatedFrame> Locate(const SyntheticView& view, const LocationPrior& prior) {
    return locator_.Locate(FrameOf(20, view), *local_map_, prior, &reason_);
  }

  /// The first key points that show landmarks of the map, as many as given, and no others.
  SyntheticView ShowingOnly(int count, const SyntheticView& full) const {
    Features some{{}, Descriptors(FeatureWorld::kDimension)};
    SyntheticView view;
    for (int i = 0; i < full.features->size() && some.size() < count; ++i) {
      const int landmark = full.landmark[static_cast<size_t>(i)];
      if (landmark < 0 || !made_->landmark_of[static_cast<size_t>(landmark)].valid()) continue;
      some.keypoints.push_back(full.features->keypoints[static_cast<size_t>(i)]);
      some.descriptors.AppendFrom(full.features->descriptors, i);
      view.landmark.push_back(landmark);
    }
    EXPECT_EQ(some.size(), count);
    view.features = std::make_shared<const Features>(std::move(some));
    return view;
  }

  void ExpectRight(const LocatedFrame& located, const SyntheticView& view, double max_wrong_ratio) {
    EXPECT_LT((located.cam_from_world.InverseTranslation() - truth_.InverseTranslation()).norm(),
              0.02);
    EXPECT_LT((located.cam_from_world * truth_.Inverse()).Angle(), 0.002);
    int wrong = 0, before = -1;
    for (const LocatedFrame::Seen& seen : located.seen) {
      EXPECT_LT(before, seen.keypoint) << "one each, by key point";
      before = seen.keypoint;
      const int shown = view.landmark[static_cast<size_t>(seen.keypoint)];
      const LandmarkId id = local_map_->landmarks[static_cast<size_t>(seen.landmark)].id;
      wrong += shown < 0 || made_->landmark_of[static_cast<size_t>(shown)] != id;
    }
    EXPECT_LE(wrong, max_wrong_ratio * static_cast<double>(located.seen.size()));
  }

  Random random_{3};
  const FeatureWorld world_ = MakeWorld();
  const SE3 truth_ = At({2.8, 0.05, 0.1});
  std::optional<SyntheticMap> made_;
  std::shared_ptr<const LocalMap> local_map_;
  CountingMatcher matcher_;
  FrameLocator locator_{world_.camera(), {}, &matcher_, nullptr};
  std::string reason_;
};

TEST_F(FrameLocatorTest, FollowsARightPredictionWithoutMatchingTheReference) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 50}, &random_);
  const auto located = Locate(view, PriorAt(Perturbed(truth_, 0.05, 0.005, &random_)));
  ASSERT_TRUE(located);
  EXPECT_EQ(matcher_.calls, 0);
  ExpectRight(*located, view, 0);
  // All that it could see, not only what the neighbour saw.
  int known = 0;
  for (int landmark : view.landmark) {
    known += landmark >= 0 && made_->landmark_of[static_cast<size_t>(landmark)].valid();
  }
  EXPECT_GT(static_cast<double>(located->seen.size()), 0.9 * known);
  EXPECT_GE(located->visible.size(), located->seen.size() * 95 / 100);
  EXPECT_EQ(local_map_->keyframes[static_cast<size_t>(located->reference)].id, made_->keyframes[5]);
  EXPECT_GT(located->reference_shared, 100);
}

/// What a rolling shutter makes of the view, of a camera that goes on as since `before`.
SyntheticView ReadRowByRow(SyntheticView view, const std::vector<Eigen::Vector3d>& landmarks_world,
                           const SE3& cam_from_world, const ReadoutMotion& motion,
                           const Camera& camera) {
  Features features = *view.features;
  for (size_t i = 0; i < view.landmark.size(); ++i) {
    Keypoint& keypoint = features.keypoints[i];
    if (view.landmark[i] < 0) continue;
    const Eigen::Vector3d point =
        cam_from_world * landmarks_world[static_cast<size_t>(view.landmark[i])];
    keypoint.px = FromMiddleRow(camera.pinhole, keypoint.px.cast<double>(),
                                RowMoment(keypoint.px.y(), camera.height), motion, 1 / point.z())
                      .cast<float>();
    keypoint.image_px = keypoint.px;
  }
  view.features = std::make_shared<const Features>(std::move(features));
  return view;
}

TEST_F(FrameLocatorTest, KnowsThatRowsAreReadOneAfterTheOther) {
  Camera camera = world_.camera();
  camera.readout_s = 0.02;
  constexpr double kBetweenS = 0.1;
  const SE3 before = SE3(RotationExp({0.03, -0.08, 0.05}), Eigen::Vector3d(0.2, 0.1, 0.3)) * truth_;
  const ReadoutMotion motion = MotionInReadout(before, truth_, kBetweenS, camera.readout_s);
  const SyntheticView view = ReadRowByRow(world_.View(truth_, {0.3, 0.3, 0, 50}, &random_),
                                          world_.landmarks(), truth_, motion, camera);
  Frame frame = FrameOf(20, view);
  frame.time = {static_cast<int64_t>(kBetweenS * 1e9)};
  LocationPrior prior = PriorAt(Perturbed(truth_, 0.05, 0.005, &random_));
  const auto error = [&](const Camera& of) {
    FrameLocator locator(of, {}, &matcher_, nullptr);
    const auto located = locator.Locate(frame, *local_map_, prior);
    return located ? (located->cam_from_world * truth_.Inverse()).Angle() : 1;
  };
  const double as_if_global = error(world_.camera());
  prior.neighbour = TimedPose{{0}, before.Inverse()};
  const double from_path = error(camera);
  EXPECT_LT(from_path, 0.3 * as_if_global);

  // What a gyroscope says of the turn stays, though the path says otherwise.
  frame = WithMotion(frame, {motion.turn_rad, Eigen::Vector3d::Zero()}, camera);
  frame.turn_is_measured = true;
  prior.neighbour->world_from_cam =
      (SE3(RotationExp({-0.2, 0.1, 0}), Eigen::Vector3d::Zero()) * before).Inverse();
  EXPECT_LT(error(camera), 0.3 * as_if_global);
  FrameLocator locator(camera, {}, &matcher_, nullptr);
  const auto located = locator.Locate(frame, *local_map_, prior);
  ASSERT_TRUE(located);
  EXPECT_EQ(located->frame.motion.turn_rad, motion.turn_rad);
  EXPECT_FALSE(located->frame.motion.travel.isZero(0));
  // Others are told where the middle row would have seen things.
  for (const LocatedFrame::Seen& seen : located->seen) EXPECT_TRUE(seen.measured);
}

TEST_F(FrameLocatorTest, LandmarksOfUncertainDistanceAreSeenAndHoldNoPose) {
  // Half the landmarks lie anywhere along the rays of the keyframe from which alone they were seen.
  auto moved = std::make_shared<LocalMap>(*local_map_);
  const SE3& seer = moved->keyframes.front().cam_from_world;
  const Eigen::Vector3d centre = seer.InverseTranslation();
  for (size_t i = 0; i < moved->landmarks.size(); i += 2) {
    LocalLandmark& landmark = moved->landmarks[i];
    const Eigen::Vector3d ray = landmark.position_world - centre;
    landmark.position_world = centre + std::exp(random_.Gaussian(0.1)) * ray;
    const double sigma_of_unit_focal = 0.1 * world_.world().pinhole.fx;
    landmark.position_noise = sigma_of_unit_focal * sigma_of_unit_focal * ray * ray.transpose();
  }
  auto trusted = std::make_shared<LocalMap>(*moved);
  for (LocalLandmark& landmark : trusted->landmarks) landmark.position_noise.setZero();
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 50}, &random_);
  const LocationPrior prior = PriorAt(At({2.7, 0.0, 0.05}));
  const auto located = locator_.Locate(FrameOf(20, view), *moved, prior);
  const auto misled = locator_.Locate(FrameOf(20, view), *trusted, prior);
  ASSERT_TRUE(located);
  const auto error = [&](const LocatedFrame& frame) {
    return (frame.cam_from_world.InverseTranslation() - truth_.InverseTranslation()).norm();
  };
  EXPECT_LT(error(*located), 0.03);
  const auto uncertain = [](const LocatedFrame& frame) {
    return std::count_if(frame.seen.begin(), frame.seen.end(),
                         [](const auto& seen) { return seen.landmark % 2 == 0; });
  };
  EXPECT_GT(uncertain(*located), misled ? 1.5 * static_cast<double>(uncertain(*misled)) : 50);
}

TEST_F(FrameLocatorTest, SeesMoreFromABetterPose) {
  const SyntheticView view = world_.View(truth_, {0.8, 0.3, 0, 50}, &random_);
  LocationPrior prior = PriorAt(Perturbed(truth_, 0.05, 0.005, &random_));
  // Known beforehand only in a corner of the image, which says little of the rest.
  std::vector<LandmarkId> cornered;
  for (size_t i = 0; i < view.landmark.size(); ++i) {
    const Eigen::Vector2f& px = view.features->keypoints[i].px;
    if (view.landmark[i] >= 0 && px.x() < 150 && px.y() < 140)
      cornered.push_back(made_->landmark_of[static_cast<size_t>(view.landmark[i])]);
  }
  std::erase_if(prior.landmarks, [&](LandmarkId id) {
    return std::find(cornered.begin(), cornered.end(), id) == cornered.end();
  });
  LocatorOptions options;
  options.local_radius_px = 2.5;
  FrameLocator patient(world_.camera(), options, &matcher_, nullptr);
  options.local_rounds = 1;
  FrameLocator hasty(world_.camera(), options, &matcher_, nullptr);
  const auto first = hasty.Locate(FrameOf(20, view), *local_map_, prior, &reason_);
  const auto located = patient.Locate(FrameOf(20, view), *local_map_, prior, &reason_);
  ASSERT_TRUE(first && located) << reason_ << ", " << prior.landmarks.size();
  EXPECT_EQ(matcher_.calls, 0);
  EXPECT_LT(static_cast<double>(first->seen.size()), 0.9 * double(located->seen.size()));
  ExpectRight(*located, view, 0);
}

TEST_F(FrameLocatorTest, MatchesTheReferenceWhereThePredictionIsWrong) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 50}, &random_);
  for (const double off_rad : {0.15, 1.0, 3.1}) {
    matcher_.calls = 0;
    const auto located = Locate(view, PriorAt(Perturbed(truth_, 0.5, off_rad, &random_)));
    ASSERT_TRUE(located) << off_rad << ": " << reason_;
    EXPECT_GE(matcher_.calls, 1);
    ExpectRight(*located, view, 0);
  }
}

TEST_F(FrameLocatorTest, DoesNotTrustAPredictionThatHardlyAnythingConfirms) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 50}, &random_);
  const SE3 wrong = SE3(truth_.rotation(), truth_.translation() + Eigen::Vector3d(0.9, 0, 0));
  const LocationPrior prior = PriorAt(wrong);
  // Some landmarks have a double just where the wrong pose would see them.
  Features features = *view.features;
  SyntheticView doubled = view;
  int doubles = 0;
  for (LandmarkId id : prior.landmarks) {
    const Landmark& landmark = made_->map.At(id);
    const Eigen::Vector2d px = world_.camera().pinhole.Project(wrong * landmark.position_world);
    if (px.x() < 0 || px.x() > 751 || px.y() < 0 || px.y() > 479 || doubles == 30) continue;
    ++doubles;
    features.keypoints.push_back(KeypointAt(px));
    const Observation& shown = landmark.representative;
    features.descriptors.AppendFrom(made_->map.At(shown.keyframe).features().descriptors,
                                    shown.keypoint);
    doubled.landmark.push_back(-1);
  }
  doubled.features = std::make_shared<const Features>(std::move(features));
  ASSERT_LT(doubles, 0.2 * static_cast<double>(prior.landmarks.size()));
  const auto located = Locate(doubled, prior);
  ASSERT_TRUE(located) << reason_;
  EXPECT_GE(matcher_.calls, 1);
  ExpectRight(*located, doubled, 0);

  FrameLocator trusting(world_.camera(), OptionsWith(&LocatorOptions::min_predicted_share, 0.0),
                        &matcher_, nullptr);
  const auto fooled = trusting.Locate(FrameOf(20, doubled), *local_map_, prior);
  ASSERT_TRUE(fooled);
  EXPECT_GT((fooled->cam_from_world.InverseTranslation() - truth_.InverseTranslation()).norm(),
            0.5);
}

TEST_F(FrameLocatorTest, MatchesTheReferenceWhereAPredictionShowsTooFew) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 50}, &random_);
  LocationPrior prior = PriorAt(truth_);
  // Enough for the prediction, too few for a pose; the window is too small to find others.
  LocatorOptions options;
  options.local_radius_px = 1e-6;
  prior.landmarks.resize(static_cast<size_t>(options.min_inliers - 1));
  FrameLocator locator(world_.camera(), options, &matcher_, nullptr);
  const auto located = locator.Locate(FrameOf(20, view), *local_map_, prior);
  ASSERT_TRUE(located);
  EXPECT_GT(matcher_.calls, 0);
  ExpectRight(*located, view, 0);
}

TEST_F(FrameLocatorTest, MatchesTheReferenceWhereNothingIsPredicted) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 0}, &random_);
  const auto located = Locate(view, {});
  ASSERT_TRUE(located) << reason_;
  EXPECT_EQ(matcher_.calls, 1);
  ExpectRight(*located, view, 0);
}

TEST_F(FrameLocatorTest, StandsFortyPercentWrongDescriptors) {
  for (const bool predicted : {true, false}) {
    const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0.4, 50}, &random_);
    LocationPrior prior = PriorAt(Perturbed(truth_, 0.05, 0.005, &random_));
    if (!predicted) prior.cam_from_world.reset();
    const auto located = Locate(view, prior);
    ASSERT_TRUE(located) << reason_;
    EXPECT_GT(located->seen.size(), 100u);
    ExpectRight(*located, view, 0.01);
  }
}

TEST_F(FrameLocatorTest, IgnoresPriorLandmarksThatTheLocalMapHasNot) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0, 0}, &random_);
  LocationPrior prior = PriorAt(truth_);
  for (int64_t id : {int64_t{-1}, int64_t{100'000}, int64_t{1} << 60})
    prior.landmarks.push_back({id});
  prior.reference = {4711};
  const auto located = Locate(view, prior);
  ASSERT_TRUE(located);
  ExpectRight(*located, view, 0);
}

TEST_F(FrameLocatorTest, SaysWhyThereIsNoPose) {
  SyntheticView nothing;
  nothing.features = std::make_shared<const Features>(
      RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random_));
  EXPECT_FALSE(Locate(nothing, PriorAt(truth_)));
  EXPECT_EQ(reason_, "no pose from 300 key points");

  SyntheticView empty;
  empty.features =
      std::make_shared<const Features>(Features{{}, Descriptors(FeatureWorld::kDimension)});
  EXPECT_FALSE(Locate(empty, PriorAt(truth_)));
  EXPECT_EQ(reason_, "no pose from 0 key points");

  const SyntheticView few = ShowingOnly(22, world_.View(truth_, {0.5, 0.2, 0, 0}, &random_));
  EXPECT_FALSE(Locate(few, PriorAt(truth_)));
  EXPECT_THAT(reason_, testing::HasSubstr("landmarks agree on the pose"));
}

TEST_F(FrameLocatorTest, RefusesAnUnpredictedPoseThatShouldShowFarMore) {
  const SyntheticView view = ShowingOnly(30, world_.View(truth_, {0.5, 0.2, 0, 0}, &random_));
  const auto locate = [&](double min_ratio, const LocationPrior& prior) {
    FrameLocator locator(world_.camera(),
                         OptionsWith(&LocatorOptions::min_unpredicted_ratio, min_ratio), &matcher_,
                         nullptr);
    return locator.Locate(FrameOf(20, view), *local_map_, prior);
  };
  const auto careless = locate(0, {});
  ASSERT_TRUE(careless);
  const double ratio =
      static_cast<double>(careless->seen.size()) / static_cast<double>(careless->visible.size());
  ASSERT_LT(ratio, 0.2);
  EXPECT_TRUE(locate(0.9 * ratio, {}));
  EXPECT_FALSE(locate(1.1 * ratio, {}));
  // What was expected there may be hidden or blurred.
  EXPECT_TRUE(locate(1.1 * ratio, PriorAt(truth_)));
}

TEST_F(FrameLocatorTest, IsNotFooledByAnotherPlace) {
  Random random(99);
  SyntheticWorld elsewhere;
  elsewhere.landmarks_world = LandmarksInBox(700, {-8, -5, 6}, {10, 5, 20}, &random);
  const SyntheticView view = FeatureWorld(elsewhere, 77).View(truth_, {0.5, 0.3, 0, 0}, &random_);
  EXPECT_FALSE(Locate(view, PriorAt(truth_)));
  EXPECT_FALSE(reason_.empty());
}

TEST_F(FrameLocatorTest, GivesTheSameTwice) {
  const SyntheticView view = world_.View(truth_, {0.5, 0.3, 0.3, 50}, &random_);
  const auto first = Locate(view, {}), second = Locate(view, {});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->cam_from_world.Matrix(), second->cam_from_world.Matrix());
  EXPECT_EQ(first->seen.size(), second->seen.size());
}

TEST(LocatorOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(LocatorOptions().Check());
  EXPECT_THROW(OptionsWith(&LocatorOptions::predicted_radius_px, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LocatorOptions::min_inliers, 5).Check(), Error);
  EXPECT_THROW(OptionsWith(&LocatorOptions::reference_tries, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LocatorOptions::local_rounds, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LocatorOptions::min_round_growth, 0.9).Check(), Error);
  LocatorOptions inner;
  inner.projection.ratio = 2;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
