#include "deepuav/survey/adjustment/survey_adjustment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40, kFocalPx = 450, kK1 = -0.1;

/// Photographs of hilly ground under several headings and from several heights, so that they tell
/// the lens, which bends straight lines.
struct BentSurvey {
  BentSurvey() {
    lens.camera.pinhole = {kFocalPx, kFocalPx, 376, 240};
    lens.camera.k1 = kK1;
    Random random(1);
    points = LandmarksOnGround(300, {-30, -25}, {40, 35}, 6, &random);
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d centre(6.0 * (i % 4), 12.0 * (i / 4), kHeightM - 5.0 * (i % 3));
      poses.push_back(Perturbed(LookDown(centre, 0.8 * i), 0.5, 0.2, &random));
    }
    px.resize(poses.size());
    tracks.of_keypoint.resize(poses.size());
    for (size_t t = 0; t < points.size(); ++t) Show(static_cast<int>(t), &random);
  }

  void Show(int t, Random* random) {
    constexpr double kSigmaPx = 0.3;
    Track& track = tracks.tracks.emplace_back();
    for (size_t v = 0; v < poses.size(); ++v) {
      const Eigen::Vector2d at = lens.camera.Project(poses[v] * points[static_cast<size_t>(t)]);
      if (at.x() < 0 || at.y() < 0 || at.x() > 752 || at.y() > 480) continue;
      track.sights.push_back({static_cast<int>(v), static_cast<int>(px[v].size())});
      tracks.of_keypoint[v].push_back(t);
      px[v].push_back(
          {at + Eigen::Vector2d(random->Gaussian(kSigmaPx), random->Gaussian(kSigmaPx))});
    }
  }

  /// Poses and points a little beside the truth.
  SurveyState Disturbed(const SurveyLens& with_lens) const {
    SurveyState state(tracks, poses.size(), with_lens);
    Random random(2);
    for (size_t v = 0; v < poses.size(); ++v)
      state.cam_from_world[v] = v == 0 ? poses[0] : Perturbed(poses[v], 0.3, 0.005, &random);
    for (size_t t = 0; t < points.size(); ++t) {
      if (tracks.tracks[t].sights.size() < 2) continue;
      state.points[t] = points[t] + 0.3 * RandomDirection(&random);
      state.agrees[t].assign(tracks.tracks[t].sights.size(), 1);
    }
    return state;
  }

  SurveyLens Guess(double focal_ratio) const {
    SurveyLens guess;
    guess.camera.pinhole = lens.camera.pinhole;
    guess.camera.pinhole.fx *= focal_ratio;
    guess.camera.pinhole.fy *= focal_ratio;
    guess.focal_guess_px = guess.camera.pinhole.fx;
    guess.centre_guess_px = {guess.camera.pinhole.cx, guess.camera.pinhole.cy};
    guess.is_refined = true;
    return guess;
  }

  void AdjustAll(SurveyState* state) const {
    AdjustAllViews(tracks, px, {.max_iterations = 60, .refine_lens = true, .max_last_move = 0.01},
                   {}, nullptr, state);
  }

  SurveyLens lens;
  std::vector<Eigen::Vector3d> points;
  std::vector<SE3> poses;
  Tracks tracks;
  ViewPixels px;
};

double Apart(const SE3& a, const SE3& b) {
  return (a.InverseTranslation() - b.InverseTranslation()).norm();
}

TEST(SurveyAdjustment, MovesTheFreeViewsAloneAndNoLensThatIsKnown) {
  const BentSurvey survey;
  SurveyState state = survey.Disturbed(survey.lens);
  // All but the free one are where they are in truth.
  const int free = 3;
  for (size_t v = 0; v < survey.poses.size(); ++v) {
    if (static_cast<int>(v) != free) state.cam_from_world[v] = survey.poses[v];
  }
  const SurveyState before = state;
  AdjustViews(survey.tracks, survey.px, {free},
              {.max_iterations = 20, .refine_lens = true, .max_last_move = 0.01}, {}, nullptr,
              &state);
  for (size_t v = 0; v < survey.poses.size(); ++v) {
    const bool is_held = static_cast<int>(v) != free;
    EXPECT_EQ(state.cam_from_world[v]->Matrix() == before.cam_from_world[v]->Matrix(), is_held);
  }
  EXPECT_LT(Apart(*state.cam_from_world[free], survey.poses[free]), 0.05);
  EXPECT_EQ(state.lens.camera.pinhole.fx, kFocalPx);
  EXPECT_EQ(state.lens.camera.k1, kK1);
  for (size_t t = 0; t < survey.points.size(); ++t) {
    const auto& sights = survey.tracks.tracks[t].sights;
    const bool is_seen = std::any_of(sights.begin(), sights.end(),
                                     [&](const Track::Sight& sight) { return sight.view == free; });
    EXPECT_TRUE(is_seen || state.points[t] == before.points[t]) << t;
  }
}

TEST(SurveyAdjustment, FindsTheLensWithPosesAndSaysHowWell) {
  const BentSurvey survey;
  SurveyState state = survey.Disturbed(survey.Guess(1.06));
  survey.AdjustAll(&state);
  const auto lens = DescribeLens(survey.tracks, survey.px, {}, state);
  ASSERT_TRUE(lens);
  EXPECT_TRUE(lens->is_focal_told);
  constexpr double kSigmas = 4;
  EXPECT_LT(lens->sigmas.focal, 0.01);
  EXPECT_LT(std::abs(state.lens.camera.pinhole.fx / kFocalPx - 1), kSigmas * lens->sigmas.focal);
  EXPECT_LT(std::abs(state.lens.camera.k1 - kK1), kSigmas * lens->sigmas.k1);
  EXPECT_EQ(state.cam_from_world[0]->Matrix(), survey.poses[0].Matrix()) << "it holds the gauge";
}

TEST(SurveyAdjustment, AFocalLengthThatIsHeldStaysWhileTheLensIsFoundToBend) {
  const BentSurvey survey;
  SurveyLens held = survey.Guess(1);
  held.holds_focal = true;
  held.focal_sigma = 0.2;
  SurveyState state = survey.Disturbed(held);
  survey.AdjustAll(&state);
  EXPECT_EQ(state.lens.camera.pinhole.fx, kFocalPx);
  EXPECT_NEAR(state.lens.camera.k1, kK1, 0.01);
  const auto lens = DescribeLens(survey.tracks, survey.px, {}, state);
  ASSERT_TRUE(lens);
  EXPECT_FALSE(lens->is_focal_told);
  EXPECT_EQ(lens->sigmas.focal, 0.2) << "as it was given";
}

TEST(SurveyAdjustment, OfNothingThereNothingIsMovedOrSaid) {
  const BentSurvey survey;
  SurveyState state = survey.Disturbed(survey.Guess(1.06));
  for (std::vector<uint8_t>& agrees : state.agrees) agrees.assign(agrees.size(), 0);
  const SurveyState before = state;
  survey.AdjustAll(&state);
  EXPECT_EQ(state.cam_from_world[5]->Matrix(), before.cam_from_world[5]->Matrix());
  EXPECT_EQ(state.lens.camera.pinhole.fx, before.lens.camera.pinhole.fx);
  EXPECT_FALSE(DescribeLens(survey.tracks, survey.px, {}, state));
  SurveyState known = survey.Disturbed(survey.lens);
  EXPECT_FALSE(DescribeLens(survey.tracks, survey.px, {}, known)) << "it is not refined";
}

}  // namespace
}  // namespace deepuav
