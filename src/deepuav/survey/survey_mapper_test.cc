#include "deepuav/survey/survey_mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "deepuav/base/error.h"
#include "deepuav/geometry/alignment.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr double kFocalPx = 450, kHeightM = 40;

/// Finds nothing in some photographs, and counts how often it is asked.
class BlindMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    ++asked;
    if (blind_to.contains(&a) || blind_to.contains(&b)) return {};
    return matcher_.MatchFeatures(a, b);
  }
  std::string Description() const override { return "blind"; }

  std::set<const Features*> blind_to;
  int asked = 0;

 private:
  NearestNeighbourMatcher matcher_{{}};
};

/// A survey over rolling ground, with a camera that bends straight lines and sways a little.
class SurveyMapperTest : public ::testing::Test {
 protected:
  explicit SurveyMapperTest(double relief_m = 3, double sway_rad = 0.06)
      : world_(Ground(relief_m), 2) {
    Random random(3);
    for (const SE3& pose : SurveyPath(4, 6, 14, kHeightM))
      poses_.push_back(Perturbed(pose, 0.5, sway_rad, &random));
    camera_ = world_.camera();
    bent_ = camera_;
    bent_.lens = LensModel::kRadialTangential;
    bent_.distortion = {-0.2, 0.03, 0, 0};
  }

  static SyntheticWorld Ground(double relief_m) {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksOnGround(3500, {-50, -45}, {120, 95}, relief_m, &random);
    return geometry;
  }

  /// What the photographs show, numbered as `order` says.
  std::vector<SurveyView> Views(const std::vector<int>& order, const Camera& lens,
                                double sigma_px = 0.5) {
    Random random(4);
    std::vector<SurveyView> views;
    for (const int i : order) {
      const SyntheticView straight =
          world_.View(poses_[static_cast<size_t>(i)], {sigma_px, 0.3, 0.02, 30}, &random);
      auto features = std::make_shared<Features>(*straight.features);
      for (Keypoint& keypoint : features->keypoints) {
        const Eigen::Vector3d ray = camera_.pinhole.Unproject(keypoint.px.cast<double>());
        keypoint.image_px = keypoint.px = lens.Distort(ray)->cast<float>();
      }
      SurveyView view;
      view.frame.id = {static_cast<int64_t>(views.size())};
      view.frame.time = {static_cast<int64_t>(views.size()) * 1000000000};
      view.frame.features = std::move(features);
      views.push_back(std::move(view));
    }
    return views;
  }

  std::vector<int> InOrder() const {
    std::vector<int> order(poses_.size());
    std::iota(order.begin(), order.end(), 0);
    return order;
  }

  static SurveyOptions Exhaustive() {
    SurveyOptions options;
    options.sequence_neighbours = 100;
    return options;
  }

  Camera Guess(double ratio) const {
    Camera guess = camera_;
    guess.pinhole.fx *= ratio;
    guess.pinhole.fy *= ratio;
    return guess;
  }

  SurveyOutcome Run(const std::vector<SurveyView>& views, const Camera& guess, double focal_sigma,
                    int threads = 0) {
    SurveyOptions options = Exhaustive();
    options.threads = threads;
    return SurveyMapper(guess, focal_sigma, options, {&matcher_}, nullptr).Run(views);
  }

  /// Root mean square of the positions off the truth, after alignment, m.
  double PositionError(const SurveyOutcome& outcome, const std::vector<int>& order) const {
    std::vector<Eigen::Vector3d> found, truth;
    for (size_t v = 0; v < order.size(); ++v) {
      const SurveyOutcome::Place& place = outcome.places[v];
      if (!place.map.valid()) continue;
      found.push_back(
          outcome.atlas.At(place.map).At(place.keyframe).cam_from_world.InverseTranslation());
      truth.push_back(poses_[static_cast<size_t>(order[v])].InverseTranslation());
    }
    const auto truth_from_found = Align(found, truth, AlignmentKind::kSimilar);
    if (!truth_from_found) return 1e9;
    double squared = 0;
    for (size_t i = 0; i < found.size(); ++i)
      squared += (*truth_from_found * found[i] - truth[i]).squaredNorm();
    return std::sqrt(squared / static_cast<double>(found.size()));
  }

  static int Mapped(const SurveyOutcome& outcome) {
    return static_cast<int>(std::count_if(outcome.places.begin(), outcome.places.end(),
                                          [](const auto& place) { return place.map.valid(); }));
  }

  FeatureWorld world_;
  std::vector<SE3> poses_;
  Camera camera_, bent_;
  NearestNeighbourMatcher matcher_{{}};
};

TEST_F(SurveyMapperTest, ACalibratedCameraIsKept) {
  const std::vector<int> order = InOrder();
  const SurveyOutcome outcome = Run(Views(order, camera_), camera_, 0);
  EXPECT_EQ(Mapped(outcome), std::ssize(order));
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  EXPECT_EQ(outcome.camera.pinhole.fx, kFocalPx);
  EXPECT_FALSE(outcome.lens);
  EXPECT_LT(PositionError(outcome, order), 0.05);
}

TEST_F(SurveyMapperTest, FindsTheLensThatIsFarFromTheGuess) {
  const std::vector<int> order = InOrder();
  const std::vector<SurveyView> views = Views(order, bent_);
  for (const double ratio : {0.4, 0.7, 1.0, 1.5, 3.0}) {
    const SurveyOutcome outcome = Run(views, Guess(ratio), 0.1);
    EXPECT_EQ(Mapped(outcome), std::ssize(order)) << ratio;
    EXPECT_NEAR(outcome.camera.pinhole.fx / kFocalPx, 1, 0.01) << ratio;
    ASSERT_EQ(outcome.camera.distortion.size(), 4u) << ratio;
    EXPECT_NEAR(outcome.camera.distortion[0], -0.2, 0.03) << ratio;
    ASSERT_TRUE(outcome.lens);
    EXPECT_LT(outcome.lens->sigmas.focal, 0.01);
    EXPECT_LT(PositionError(outcome, order), 0.15) << ratio;
  }
}

TEST_F(SurveyMapperTest, MorePhotographsTellTheFocalLengthThatFewDoNot) {
  const std::vector<int> order = InOrder();
  const std::vector<SurveyView> views = Views(order, bent_, 2);
  SurveyOptions options = Exhaustive();
  options.trial_views = 3;
  for (const double ratio : {0.4, 3.0}) {
    const SurveyOutcome outcome =
        SurveyMapper(Guess(ratio), 0.1, options, {&matcher_}, nullptr).Run(views);
    EXPECT_EQ(Mapped(outcome), std::ssize(order)) << ratio;
    EXPECT_NEAR(outcome.camera.pinhole.fx / kFocalPx, 1, 0.05) << ratio;
  }
}

TEST_F(SurveyMapperTest, AnyOrderGivesTheSameMap) {
  std::vector<int> order = InOrder();
  std::reverse(order.begin(), order.end());
  EXPECT_LT(PositionError(Run(Views(order, bent_), Guess(0.8), 0.1), order), 0.15);
  Random random(9);
  for (size_t i = order.size() - 1; i > 0; --i)
    std::swap(order[i], order[static_cast<size_t>(random.Index(static_cast<int>(i) + 1))]);
  const SurveyOutcome shuffled = Run(Views(order, bent_), Guess(0.8), 0.1);
  EXPECT_EQ(Mapped(shuffled), std::ssize(order));
  EXPECT_LT(PositionError(shuffled, order), 0.15);
}

TEST_F(SurveyMapperTest, IsTheSameEveryTimeOnAnyNumberOfThreads) {
  const std::vector<SurveyView> views = Views(InOrder(), bent_);
  const SurveyOutcome a = Run(views, Guess(1.4), 0.1, 1), b = Run(views, Guess(1.4), 0.1, 3);
  EXPECT_EQ(a.camera.pinhole.fx, b.camera.pinhole.fx);
  for (size_t v = 0; v < views.size(); ++v) {
    const auto pose = [v](const SurveyOutcome& outcome) {
      return outcome.atlas.At(outcome.places[v].map)
          .At(outcome.places[v].keyframe)
          .cam_from_world.Matrix();
    };
    EXPECT_EQ(pose(a), pose(b));
  }
}

TEST_F(SurveyMapperTest, WhatShowsOtherGroundIsInNoMapOrAnother) {
  std::vector<SurveyView> views = Views({0, 1, 2, 3, 4, 5}, camera_);
  Random random(11);
  for (int i = 0; i < 2; ++i) {
    SurveyView alone;
    alone.frame.features = std::make_shared<Features>(
        RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random));
    views.insert(views.begin() + 3, alone);
  }
  const SurveyOutcome outcome = Run(views, camera_, 0);
  EXPECT_EQ(Mapped(outcome), 6);
  EXPECT_FALSE(outcome.places[3].map.valid());
  EXPECT_FALSE(outcome.places[4].map.valid());
}

TEST_F(SurveyMapperTest, TheLearnedMatcherBringsInWhatStaysOutside) {
  const std::vector<int> order = InOrder();
  const std::vector<SurveyView> views = Views(order, camera_);
  BlindMatcher quick, learned;
  for (const size_t v : {9, 10, 23}) quick.blind_to.insert(views[v].frame.features.get());
  const SurveyOutcome without =
      SurveyMapper(camera_, 0, Exhaustive(), {.quick = &quick}, nullptr).Run(views);
  EXPECT_EQ(Mapped(without), std::ssize(order) - 3);
  const SurveyOutcome with =
      SurveyMapper(camera_, 0, Exhaustive(), {.quick = &quick, .of_outside = &learned}, nullptr)
          .Run(views);
  EXPECT_EQ(Mapped(with), std::ssize(order));
  EXPECT_EQ(with.atlas.Remaining().size(), 1u);
  EXPECT_LT(PositionError(with, order), 0.05);
  EXPECT_LE(learned.asked, 3 * std::ssize(order)) << "of pairs that concern the three alone";
}

TEST_F(SurveyMapperTest, TheLearnedMatcherIsNotAskedWhereAllComeIn) {
  BlindMatcher learned;
  SurveyMapper(camera_, 0, Exhaustive(), {.quick = &matcher_, .of_outside = &learned}, nullptr)
      .Run(Views(InOrder(), camera_));
  EXPECT_EQ(learned.asked, 0);
}

TEST_F(SurveyMapperTest, OfNothingThereIsNoMap) {
  EXPECT_TRUE(Run({}, camera_, 0.1).atlas.Remaining().empty());
  SurveyView empty;
  empty.frame.features = std::make_shared<Features>(Features{{}, Descriptors(64)});
  const SurveyOutcome outcome = Run({empty, empty, empty}, camera_, 0.1);
  EXPECT_TRUE(outcome.atlas.Remaining().empty());
  EXPECT_EQ(outcome.places.size(), 3u);
}

/// Seen straight down, level ground looks the same to any focal length at the height that goes with
/// it; photographs whose rows are read one after the other fit some wrong one best.
class LevelSurveyTest : public SurveyMapperTest {
 protected:
  LevelSurveyTest() : SurveyMapperTest(0.3, 0.002) {}

  std::vector<SurveyView> Sheared(double shear_px) {
    std::vector<SurveyView> views = Views(InOrder(), camera_);
    Random random(12);
    for (SurveyView& view : views) {
      auto features = std::make_shared<Features>(*view.frame.features);
      const float across = static_cast<float>(random.Gaussian(shear_px));
      const float along = static_cast<float>(random.Gaussian(shear_px));
      for (Keypoint& keypoint : features->keypoints) {
        const float row = (keypoint.px.y() - static_cast<float>(camera_.pinhole.cy)) /
                          static_cast<float>(camera_.pinhole.cy);
        keypoint.px += row * Eigen::Vector2f(across, along);
        keypoint.image_px = keypoint.px;
      }
      view.frame.features = std::move(features);
    }
    return views;
  }
};

TEST_F(LevelSurveyTest, AFocalLengthThatNothingTellsIsKept) {
  for (const double ratio : {0.8, 1.0, 1.2}) {
    const SurveyOutcome outcome = Run(Sheared(1.5), Guess(ratio), 0.3);
    EXPECT_EQ(Mapped(outcome), std::ssize(InOrder())) << ratio;
    EXPECT_NEAR(outcome.camera.pinhole.fx, Guess(ratio).pinhole.fx, 1e-6) << ratio;
    ASSERT_TRUE(outcome.lens) << ratio;
    EXPECT_FALSE(outcome.lens->is_focal_told) << ratio;
    EXPECT_EQ(outcome.lens->sigmas.focal, 0.3) << ratio;
    EXPECT_LT(PositionError(outcome, InOrder()), 1) << ratio;
  }
}

TEST_F(SurveyMapperTest, LandmarksReprojectWhereTheyAreSeen) {
  const SurveyOutcome outcome = Run(Views(InOrder(), bent_), Guess(0.8), 0.1);
  const Map& map = outcome.atlas.At(outcome.atlas.Remaining().front());
  double squared = 0;
  int count = 0;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    for (const Observation& seen : landmark.observations) {
      const Keyframe& keyframe = map.At(seen.keyframe);
      const Keypoint& keypoint = keyframe.features().keypoints[static_cast<size_t>(seen.keypoint)];
      const Eigen::Vector2d px =
          outcome.camera.pinhole.Project(keyframe.cam_from_world * landmark.position_world);
      squared += (px - keypoint.px.cast<double>()).squaredNorm();
      ++count;
    }
  });
  EXPECT_GT(count, 3000);
  EXPECT_LT(std::sqrt(squared / count), 1.0);
}

}  // namespace
}  // namespace deepuav
