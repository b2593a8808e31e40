#include "deepuav/survey/survey_sharpening.h"

#include <gtest/gtest.h>

#include "support/synthetic_features.h"

namespace deepuav {
namespace {

constexpr size_t kViews = 4, kPoints = 80;

/// Photographs by a lens that does not bend, of which the map says that it bends by k1.
struct WronglyBent {
  explicit WronglyBent(double k1) : camera(FeatureWorld({}, 1).camera()), views(kViews) {
    Random random(1);
    points = LandmarksOnGround(kPoints, {-8, -8}, {15, 8}, 3, &random);
    built.tracks.tracks.resize(kPoints);
    for (size_t v = 0; v < kViews; ++v) {
      const Eigen::Vector3d centre(3.0 * static_cast<double>(v), 0, 40);
      poses.push_back(Perturbed(LookDown(centre, 0.4), 1, 0.05, &random));
      std::vector<int>& of_view = built.tracks.of_keypoint.emplace_back();
      built.px.emplace_back();
      for (size_t t = 0; t < kPoints; ++t) {
        built.tracks.tracks[t].sights.push_back({static_cast<int>(v), static_cast<int>(t)});
        of_view.push_back(static_cast<int>(t));
        built.px[v].push_back({camera.pinhole.Project(poses[v] * points[t])});
      }
    }
    SurveyLens lens;
    lens.camera.pinhole = camera.pinhole;
    lens.focal_guess_px = camera.pinhole.fx;
    lens.camera.k1 = k1;
    lens.is_refined = true;
    built.state = SurveyState(built.tracks, kViews, lens);
    for (size_t v = 0; v < kViews; ++v) built.state.cam_from_world[v] = poses[v];
    for (size_t t = 0; t < kPoints; ++t) built.state.points[t] = points[t];
  }

  void KeepLensOneToOne() {
    SurveySharpening(&views, camera, true, {}, {}, nullptr).KeepLensOneToOne(nullptr, &built);
  }

  Camera camera;
  std::vector<SurveyView> views;
  std::vector<Eigen::Vector3d> points;
  std::vector<SE3> poses;
  BuiltSurvey built{{}, SurveyState({}, 0, {}), {}};
};

TEST(KeepLensOneToOne, ALensThatFoldsOverInsideTheImageIsNotUsed) {
  WronglyBent survey(-1.2);
  survey.KeepLensOneToOne();
  const SurveyState& state = survey.built.state;
  EXPECT_FALSE(state.lens.is_refined);
  EXPECT_TRUE(state.lens.camera.IsUndistorted());
  EXPECT_EQ(WithLens(survey.camera, state.lens).lens, LensModel::kPinhole);
  EXPECT_EQ(state.ViewCount(), static_cast<int>(kViews));
  for (size_t t = 0; t < kPoints; ++t) {
    ASSERT_TRUE(state.points[t]) << t;
    for (size_t v = 0; v < kViews; ++v)
      EXPECT_LT(SquaredErrorPx(state.lens.camera, *state.cam_from_world[v] * *state.points[t],
                               survey.built.px[v][t].px),
                0.01);
  }
}

TEST(KeepLensOneToOne, ALensThatBendsALittleStays) {
  constexpr double kK1 = -0.05;
  WronglyBent survey(kK1);
  survey.KeepLensOneToOne();
  const SurveyState& state = survey.built.state;
  EXPECT_TRUE(state.lens.is_refined);
  EXPECT_EQ(state.lens.camera.k1, kK1);
  for (size_t v = 0; v < kViews; ++v)
    EXPECT_EQ(state.cam_from_world[v]->Matrix(), survey.poses[v].Matrix());
  const Camera bent = WithLens(survey.camera, state.lens);
  EXPECT_EQ(bent.lens, LensModel::kRadialTangential);
  EXPECT_EQ(bent.distortion, (std::vector<double>{kK1, 0, 0, 0}));
}

}  // namespace
}  // namespace deepuav
