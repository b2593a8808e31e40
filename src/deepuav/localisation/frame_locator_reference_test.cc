#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "deepuav/localisation/testing/frame_locator_fixture.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

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

}  // namespace
}  // namespace deepuav
