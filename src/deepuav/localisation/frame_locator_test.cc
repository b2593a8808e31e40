#include "deepuav/localisation/frame_locator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/localisation/testing/frame_locator_fixture.h"
#include "deepuav/map/frame_motion.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

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
