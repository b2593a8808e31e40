#include "deepuav/survey/pairs/pair_evidence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "deepuav/geometry/alignment.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/survey/survey_mapper.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40, kStepM = 25, kRoofM = 10;
constexpr int kPhotographs = 8, kOnRoof = 700;
const cv::Size kSize(752, 480);

/// A map of the views' key points as they are, without poses and points.
BuiltSurvey WithoutPoints(const std::vector<SurveyView>& views, const Pinhole& pinhole) {
  ViewPixels px;
  Tracks none;
  for (const SurveyView& view : views) {
    std::vector<SightPixel>& of_view = px.emplace_back();
    for (const Keypoint& keypoint : view.frame.features->keypoints)
      of_view.push_back({keypoint.px.cast<double>()});
    none.of_keypoint.emplace_back();
  }
  SurveyLens lens;
  lens.camera.pinhole = pinhole;
  return {none, SurveyState(none, views.size(), lens), px};
}

/// A line of photographs that overlap by half, over thinly textured ground; the first and the last
/// show roofs of one kind, hip roofs with more on them than all the ground around.
class AlikeRoofs : public ::testing::Test {
 protected:
  AlikeRoofs() : world_(Ground(), 2) {
    for (int i = 0; i < kOnRoof; ++i) world_.MakeAlike(i + kOnRoof, i);
    Random random(5);
    for (int i = 0; i < kPhotographs; ++i)
      poses_.push_back(
          Perturbed(LookDown({i * kStepM, 0, kHeightM}, M_PI / 2), 0.5, 0.05, &random));
    for (const SE3& pose : poses_) {
      SurveyView view;
      view.frame.id = {static_cast<int64_t>(views_.size())};
      view.frame.time = {static_cast<int64_t>(views_.size()) * 1000000000};
      view.frame.features = world_.View(pose, {0.4, 0.2, 0, 30}, &random).features;
      views_.push_back(std::move(view));
    }
    options_.sequence_neighbours = kPhotographs;
  }

  static SyntheticWorld Ground() {
    Random random(1);
    SyntheticWorld geometry;
    std::vector<Eigen::Vector3d>& all = geometry.landmarks_world;
    for (int i = 0; i < kOnRoof; ++i) {
      const double x = random.Uniform(-kRoofM, kRoofM), y = random.Uniform(-kRoofM, kRoofM);
      all.emplace_back(x, y, 8 - 0.4 * std::max(std::abs(x), std::abs(y)));
    }
    for (int i = 0; i < kOnRoof; ++i)
      all.push_back(all[static_cast<size_t>(i)] +
                    Eigen::Vector3d(kStepM * (kPhotographs - 1), 0, 0));
    const auto ground =
        LandmarksOnGround(3600, {-50, -35}, {kStepM * kPhotographs + 15, 35}, 2, &random);
    all.insert(all.end(), ground.begin(), ground.end());
    return geometry;
  }

  SurveyOutcome Run(const SurveyOptions& options) {
    return SurveyMapper(world_.camera(), 0, options, {&matcher_}, nullptr).Run(views_);
  }

  /// The farthest photograph in the first map, after alignment, m.
  double Farthest(const SurveyOutcome& outcome) const {
    std::vector<Eigen::Vector3d> found, truth;
    for (size_t v = 0; v < poses_.size(); ++v) {
      const SurveyOutcome::Place& place = outcome.places[v];
      if (place.map != outcome.atlas.Remaining().front()) continue;
      found.push_back(
          outcome.atlas.At(place.map).At(place.keyframe).cam_from_world.InverseTranslation());
      truth.push_back(poses_[v].InverseTranslation());
    }
    const auto truth_from_found = Align(found, truth, AlignmentKind::kSimilar);
    double farthest = 0;
    for (size_t i = 0; i < found.size(); ++i)
      farthest = std::max(farthest, (*truth_from_found * found[i] - truth[i]).norm());
    return farthest;
  }

  /// Those that one epipolar geometry holds for.
  std::vector<Match> Matches(int a, int b) {
    const std::vector<MatchedPair> pairs =
        PairMatching(&views_, &matcher_, nullptr, options_).Match({{a, b, 0, 0}}, nullptr);
    return pairs.empty() ? std::vector<Match>{} : pairs.front().matches;
  }
  double Coverage(int a, int b) {
    return MatchCoverage(*views_[static_cast<size_t>(a)].frame.features,
                         *views_[static_cast<size_t>(b)].frame.features, Matches(a, b), kSize,
                         options_.evidence);
  }

  FeatureWorld world_;
  std::vector<SE3> poses_;
  std::vector<SurveyView> views_;
  SurveyOptions options_;
  NearestNeighbourMatcher matcher_{{}};
};

TEST_F(AlikeRoofs, WhatIsTheSameMatchesAllOverAndWhatIsAlikeInParts) {
  for (int v = 1; v < kPhotographs; ++v) EXPECT_GT(Coverage(v - 1, v), 0.7) << v;
  EXPECT_GT(Matches(0, kPhotographs - 1).size(), 200u);
  EXPECT_LT(Coverage(0, kPhotographs - 1), 0.45);
}

TEST_F(AlikeRoofs, WhatIsTooLittleToTellIsAsTheOptionsSay) {
  EXPECT_GT(Coverage(0, 1), 0);
  options_.evidence.telling_keypoints = 1000;
  EXPECT_EQ(Coverage(0, 1), 0) << "no cell tells";
}

TEST_F(AlikeRoofs, FewMatchesCoverNothing) {
  const Features& a = *views_[0].frame.features;
  EXPECT_EQ(MatchCoverage(a, *views_[1].frame.features, {}, kSize, {}), 0);
  EXPECT_EQ(MatchCoverage(a, *views_[1].frame.features, {{0, 0, 0.1f}}, kSize, {}), 0);
}

TEST_F(AlikeRoofs, KeypointsNewerThanTheMapAreJudgedByTheirLines) {
  BuiltSurvey map = WithoutPoints(views_, world_.camera().pinhole);
  map.state.cam_from_world[0] = poses_[0];
  map.state.cam_from_world[1] = poses_[1];
  const PairJudge judge(views_, map.px, kSize, options_);
  const MatchedPair pair{0, 1, Matches(0, 1)};
  EXPECT_GT(judge.AgreeingShare(pair, map), 0.95);
  map.state.cam_from_world[1] = LookDown({0, kStepM, kHeightM}, M_PI / 2);
  EXPECT_LT(judge.AgreeingShare(pair, map), 0.3);
}

TEST_F(AlikeRoofs, DoNotPutPhotographsOnTopOfOneAnother) {
  SurveyOptions blind = options_;
  blind.contradicting_matches = 100'000;
  const SurveyOutcome misled = Run(blind);
  ASSERT_FALSE(misled.atlas.Remaining().empty());
  EXPECT_GT(Farthest(misled), 10) << "the world is too easy for this test";

  const SurveyOutcome outcome = Run(options_);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  EXPECT_TRUE(
      std::ranges::all_of(outcome.places, [](const auto& place) { return place.map.valid(); }));
  EXPECT_LT(Farthest(outcome), 0.5);
  EXPECT_TRUE(outcome.doubtful.empty());
}

TEST_F(AlikeRoofs, APartOfTheLineThatTheyHoldElsewhereIsPlacedAgain) {
  options_.suspect_coverage = 0;  // nothing is set aside for being matched in parts
  const SurveyOutcome outcome = Run(options_);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  EXPECT_LT(Farthest(outcome), 0.5);
  EXPECT_TRUE(outcome.doubtful.empty());
}

TEST_F(AlikeRoofs, ThatStayOnTopOfOneAnotherAreCalledDoubtful) {
  options_.suspect_coverage = 0;
  options_.evidence.coverage_power = 0;  // what matches much counts much, over however little
  const SurveyOutcome outcome = Run(options_);
  ASSERT_FALSE(outcome.atlas.Remaining().empty());
  EXPECT_GT(Farthest(outcome), 10);
  EXPECT_FALSE(outcome.doubtful.empty());
}

TEST_F(AlikeRoofs, ThatWouldStayOnTopOfOneAnotherAreToldApartByTheOrder) {
  options_.suspect_coverage = 0;
  options_.evidence.coverage_power = 1;
  options_.sequence_neighbours = 2;  // The others are matched for being near one another.
  options_.position_neighbours = 2 * kPhotographs;
  for (size_t v = 0; v < views_.size(); ++v) views_[v].position_m = poses_[v].InverseTranslation();
  const SurveyOutcome outcome = Run(options_);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  EXPECT_LT(Farthest(outcome), 0.5);
  EXPECT_TRUE(outcome.doubtful.empty());
}

/// A line of photographs over thinly textured ground; three of them show a roof, and one far from
/// it shows another one that looks just like it, as from above the first, with more on it than all
/// the ground around.
class MisleadingRoof : public ::testing::Test {
 protected:
  static constexpr int kMisled = 6;

  MisleadingRoof() : world_(Ground(), 2) {
    Random random(5);
    for (const double y : {-5.0, 0.0, 5.0}) poses_.push_back(Above(0, y, &random));
    for (int i = 1; i < 8; ++i) poses_.push_back(Above(kAlongM * i, 0, &random));
    for (const SE3& pose : poses_) {
      SurveyView view;
      view.frame.id = {static_cast<int64_t>(views_.size())};
      view.frame.time = {static_cast<int64_t>(views_.size()) * 1000000000};
      view.frame.features = world_.View(pose, {0.4, 0.2, 0, 30}, &random).features;
      views_.push_back(std::move(view));
    }
    AddRoofTo(kMisled, Above(3, 3, &random), &random);
    options_.sequence_neighbours = static_cast<int>(poses_.size());
    options_.suspect_coverage = 0;  // nothing is set aside for being matched in parts
  }

  static SE3 Above(double x, double y, Random* random) {
    return Perturbed(LookDown({x, y, kHeightM}, M_PI / 2), 0.5, 0.05, random);
  }

  static SyntheticWorld Ground() {
    Random random(1);
    SyntheticWorld geometry;
    std::vector<Eigen::Vector3d>& all = geometry.landmarks_world;
    for (int i = 0; i < kOnRoof; ++i) {
      const double x = random.Uniform(-kRoofM, kRoofM), y = random.Uniform(-kRoofM, kRoofM);
      all.emplace_back(x, y, 8 - 0.4 * std::max(std::abs(x), std::abs(y)));
    }
    const auto ground = LandmarksOnGround(1800, {-50, -45}, {kAlongM * 8 + 40, 45}, 2, &random);
    all.insert(all.end(), ground.begin(), ground.end());
    return geometry;
  }

  void AddRoofTo(int view, const SE3& as_from, Random* random) {
    SurveyView& misled = views_[static_cast<size_t>(view)];
    Features both = *misled.frame.features;
    const SyntheticView roof = world_.View(as_from, {0.4, 0.2, 0, 0}, random);
    for (int i = 0; i < roof.features->size(); ++i) {
      const auto at = static_cast<size_t>(i);
      if (roof.landmark[at] >= kOnRoof) continue;
      both.keypoints.push_back(roof.features->keypoints[at]);
      both.descriptors.AppendFrom(roof.features->descriptors, i);
    }
    misled.frame.features = std::make_shared<const Features>(std::move(both));
  }

  static constexpr double kAlongM = 12;
  FeatureWorld world_;
  std::vector<SE3> poses_;
  std::vector<SurveyView> views_;
  SurveyOptions options_;
  NearestNeighbourMatcher matcher_{{}};
};

TEST_F(MisleadingRoof, APhotographThatItHoldsElsewhereIsPlacedAgain) {
  const SurveyOutcome outcome =
      SurveyMapper(world_.camera(), 0, options_, {&matcher_}, nullptr).Run(views_);
  ASSERT_EQ(outcome.atlas.Remaining().size(), 1u);
  std::vector<Eigen::Vector3d> found, truth;
  for (size_t v = 0; v < poses_.size(); ++v) {
    const SurveyOutcome::Place& place = outcome.places[v];
    ASSERT_TRUE(place.map.valid()) << v;
    found.push_back(
        outcome.atlas.At(place.map).At(place.keyframe).cam_from_world.InverseTranslation());
    truth.push_back(poses_[v].InverseTranslation());
  }
  const auto truth_from_found = Align(found, truth, AlignmentKind::kSimilar);
  ASSERT_TRUE(truth_from_found);
  for (size_t v = 0; v < found.size(); ++v)
    EXPECT_LT((*truth_from_found * found[v] - truth[v]).norm(), 0.5) << v;
  EXPECT_TRUE(outcome.doubtful.empty());
}

TEST_F(MisleadingRoof, ViewsOfWhichMoreIsSaidAgainstTheirPlaceAreMisplaced) {
  std::vector<PairCandidate> every;
  const auto count = static_cast<int>(views_.size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) every.push_back({a, b, 0, 0});
  }
  std::vector<MatchedPair> pairs =
      PairMatching(&views_, &matcher_, nullptr, options_).Match(every, nullptr);
  BuiltSurvey map = WithoutPoints(views_, world_.camera().pinhole);
  for (size_t v = 0; v < poses_.size(); ++v) map.state.cam_from_world[v] = poses_[v];
  const PairJudge judge(views_, map.px, kSize, options_);
  EXPECT_TRUE(judge.Misplaced(&pairs, map).empty());
  map.state.cam_from_world[kMisled] = LookDown({3, 3, kHeightM}, M_PI / 2);
  const std::vector<int> misplaced = {kMisled};
  EXPECT_EQ(judge.Misplaced(&pairs, map), misplaced);
  std::vector<MatchedPair> holding;
  judge.SetHoldingAside(misplaced, map, &pairs, &holding);
  EXPECT_FALSE(holding.empty());
  for (const MatchedPair& pair : holding) EXPECT_TRUE(pair.a < kMisled - 1 && pair.b == kMisled);
}

TEST(PairEvidenceOptions, APairCannotBeExplainedAndContradict) {
  SurveyOptions options;
  options.evidence.contradicting_share = 0.6;
  EXPECT_THROW(options.Check(), Error);
}

}  // namespace
}  // namespace deepuav
