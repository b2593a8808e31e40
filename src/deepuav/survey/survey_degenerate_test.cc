#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/survey/survey_mapper.h"
#include "support/path_error.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40;

/// A few photographs of rolling ground, from wherever the test takes them.
class SurveyDegenerateTest : public ::testing::Test {
 protected:
  static SyntheticWorld Ground() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksOnGround(1500, {-50, -45}, {80, 60}, 3, &random);
    return geometry;
  }

  SurveyView Photograph(const SE3& pose) {
    SurveyView view;
    view.frame.features = world_.View(pose, {0.5, 0.3, 0.02, 30}, &random_).features;
    return view;
  }

  std::vector<SurveyView> Photographs(const std::vector<SE3>& poses) {
    std::vector<SurveyView> views;
    for (const SE3& pose : poses) {
      views.push_back(Photograph(pose));
      views.back().frame.id = {static_cast<int64_t>(views.size()) - 1};
      views.back().frame.time = {static_cast<int64_t>(views.size()) * 1000000000};
    }
    return views;
  }

  SurveyOutcome Run(const std::vector<SurveyView>& views,
                    const std::function<bool()>& stop = nullptr) {
    SurveyOptions options;
    options.sequence_neighbours = 100;
    return SurveyMapper(world_.camera(), 0, options, {&matcher_}, nullptr).Run(views, stop);
  }

  static Eigen::Vector3d PlaceOf(const SurveyOutcome& outcome, size_t view) {
    const SurveyOutcome::Place& place = outcome.places[view];
    return outcome.atlas.At(place.map).At(place.keyframe).cam_from_world.InverseTranslation();
  }

  FeatureWorld world_{Ground(), 2};
  Random random_{3};
  NearestNeighbourMatcher matcher_{{}};
};

/// Every photograph is in a map or in none, and no map is without photographs.
void ExpectWhole(const SurveyOutcome& outcome, size_t photographs) {
  ASSERT_EQ(outcome.places.size(), photographs);
  for (const SurveyOutcome::Place& place : outcome.places) {
    if (!place.map.valid()) continue;
    ASSERT_TRUE(std::ranges::count(outcome.atlas.Remaining(), place.map));
    EXPECT_TRUE(outcome.atlas.At(place.map).Contains(place.keyframe));
  }
  for (const MapId map : outcome.atlas.Remaining())
    EXPECT_GE(outcome.atlas.At(map).KeyframeCount(), SurveyOptions().min_map_views);
}

TEST_F(SurveyDegenerateTest, PhotographsFromOnePlaceAreNoMap) {
  std::vector<SE3> poses;
  for (int i = 0; i < 6; ++i)
    poses.push_back(Perturbed(LookDown({10, 10, kHeightM}, 0.4 * i), 0, 0.15, &random_));
  const SurveyOutcome outcome = Run(Photographs(poses));
  EXPECT_TRUE(outcome.atlas.Remaining().empty()) << "nothing tells how far the ground is";
}

TEST_F(SurveyDegenerateTest, PhotographsThatComeTwiceAreAtTheSamePlace) {
  std::vector<SE3> poses;
  for (const SE3& pose : SurveyPath(2, 3, 14, kHeightM)) poses.insert(poses.end(), 2, pose);
  std::vector<SurveyView> views = Photographs(poses);
  for (size_t v = 1; v < views.size(); v += 2)
    views[v].frame.features = views[v - 1].frame.features;
  const SurveyOutcome outcome = Run(views);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  std::vector<Eigen::Vector3d> found, truth;
  for (size_t v = 0; v < views.size(); ++v) {
    ASSERT_TRUE(outcome.places[v].map.valid()) << v;
    found.push_back(PlaceOf(outcome, v));
    truth.push_back(poses[v].InverseTranslation());
  }
  for (size_t v = 1; v < views.size(); v += 2)  // beside the height, which is the map's unit
    EXPECT_LT((found[v] - found[v - 1]).norm(), 1e-3) << v;
  EXPECT_LT(RmseAfterAlignment(found, truth), 0.1);
}

TEST_F(SurveyDegenerateTest, StoppedAnywhereItGivesWhatHoldsTogether) {
  const std::vector<SurveyView> views = Photographs(SurveyPath(2, 3, 14, kHeightM));
  int asked = 0;
  Run(views, [&] { return ++asked < 0; });
  ASSERT_GT(asked, 0);
  constexpr int kPlaces = 3;
  for (int i = 0; i < kPlaces; ++i) {
    int left = asked * i / kPlaces;
    const SurveyOutcome outcome = Run(views, [&] { return left-- <= 0; });
    ExpectWhole(outcome, views.size());
  }
}

/// A wrong focal length feigns parallax, so that all photographs may count as misplaced.
TEST_F(SurveyDegenerateTest, PhotographsFromOnePlaceWithAnUnknownLensLeaveNoEmptyMap) {
  std::vector<SE3> poses;
  for (int i = 0; i < 6; ++i)
    poses.push_back(Perturbed(LookDown({10, 10, kHeightM}, 0.4 * i), 0, 0.15, &random_));
  SurveyOptions options;
  options.sequence_neighbours = 100;
  constexpr double kFocalSigma = 0.1;  // the focal length is a guess, as from EXIF
  const SurveyOutcome outcome =
      SurveyMapper(world_.camera(), kFocalSigma, options, {&matcher_}, nullptr)
          .Run(Photographs(poses));
  ExpectWhole(outcome, poses.size());
}

/// What the first ones are taken not to tell, all of them do, without patches that say how well.
TEST_F(SurveyDegenerateTest, AllTellTheFocalLengthThatTheFirstOnesDidNot) {
  std::vector<SE3> poses;
  for (const SE3& pose : SurveyPath(3, 5, 12, kHeightM))
    poses.push_back(Perturbed(pose, 3, 0.2, &random_));
  Camera guessed = world_.camera();
  guessed.pinhole.fx = guessed.pinhole.fy = 1.05 * guessed.pinhole.fx;
  SurveyOptions options;
  options.sequence_neighbours = 100;
  // It is held then.
  options.focal_agreement = 1;
  options.focal_rival_support = options.held_focal_support = 0.01;
  constexpr double kFocalSigma = 0.3;
  const SurveyOutcome outcome =
      SurveyMapper(guessed, kFocalSigma, options, {&matcher_}, nullptr).Run(Photographs(poses));
  ASSERT_TRUE(outcome.lens);
  EXPECT_TRUE(outcome.lens->is_focal_told);
  EXPECT_NEAR(outcome.camera.pinhole.fx / world_.camera().pinhole.fx, 1, 0.01);
}

}  // namespace
}  // namespace deepuav
