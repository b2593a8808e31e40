#include "deepuav/survey/adjustment/survey_sharpening.h"

#include <gtest/gtest.h>

#include <cmath>

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

/// Few photographs, measured by patches, of a lens whose principal point is not in the middle of
/// the image, where it is thought to be.
struct OffCentre {
  explicit OffCentre(double relief_m) : camera(FeatureWorld({}, 1).camera()) {
    constexpr int kOfThem = 6, kOfGround = 250;
    constexpr double kSigmaPx = 0.05;
    Random random(2);
    Pinhole truth = camera.pinhole;
    truth.cx += 5;
    truth.cy -= 4;
    std::vector<Eigen::Vector3d> points =
        LandmarksOnGround(kOfGround, {-30, -30}, {60, 60}, relief_m, &random);
    built.px.resize(kOfThem);
    built.tracks.of_keypoint.resize(kOfThem);
    views.resize(kOfThem);
    std::vector<SE3> poses;
    for (int v = 0; v < kOfThem; ++v) {
      views[static_cast<size_t>(v)].frame.time = {v * 1000000000LL};
      poses.push_back(Perturbed(LookDown({14.0 * (v % 3), 14.0 * (v / 3), 40}, v / 3 * M_PI), 0.3,
                                0.05, &random));
    }
    for (size_t t = 0; t < points.size(); ++t) {
      Track& track = built.tracks.tracks.emplace_back();
      for (size_t v = 0; v < poses.size(); ++v) {
        const Eigen::Vector2d at = truth.Project(poses[v] * points[t]);
        if (at.x() < 0 || at.y() < 0 || at.x() >= camera.width || at.y() >= camera.height) continue;
        track.sights.push_back({static_cast<int>(v), static_cast<int>(built.px[v].size())});
        built.tracks.of_keypoint[v].push_back(static_cast<int>(t));
        const Eigen::Vector2d noise(random.Gaussian(kSigmaPx), random.Gaussian(kSigmaPx));
        built.px[v].push_back({at + noise, kSigmaPx, true});
      }
    }
    SurveyLens lens;
    lens.camera.pinhole = camera.pinhole;
    lens.focal_guess_px = camera.pinhole.fx;
    lens.focal_sigma = 0.5;
    lens.centre_guess_px = {camera.pinhole.cx, camera.pinhole.cy};
    lens.is_refined = true;
    built.state = SurveyState(built.tracks, kOfThem, lens);
    built.state.model_sigma_px = 0.02;
    for (size_t v = 0; v < poses.size(); ++v) built.state.cam_from_world[v] = poses[v];
    for (size_t t = 0; t < points.size(); ++t) {
      if (built.tracks.tracks[t].sights.size() < 2) continue;
      built.state.points[t] = points[t];
      built.state.agrees[t].assign(built.tracks.tracks[t].sights.size(), 1);
    }
  }

  /// By how much the focal length is off then, as a share of it; how well it is known.
  std::pair<double, double> Sharpen(const SurveyOptions& options) const {
    SurveyMeasuring measuring;
    measuring.patches.enabled = false;  // They have measured all that there is.
    BuiltSurvey sharpened = built;
    SurveySharpening(&views, camera, true, options, measuring, nullptr)
        .Sharpen(nullptr, &sharpened);
    const auto lens = DescribeLens(sharpened.tracks, sharpened.px, options, sharpened.state);
    return {sharpened.state.lens.camera.pinhole.fx / camera.pinhole.fx - 1,
            lens ? lens->sigmas.focal : 1};
  }

  Camera camera;
  std::vector<SurveyView> views;
  BuiltSurvey built{{}, SurveyState({}, 0, {}), {}};
};

TEST(Sharpen, AFocalLengthToldToAPercentDoesNotTakeOnWhatIsThePrincipalPoints) {
  const OffCentre survey(0.6);
  const auto [off, sigma] = survey.Sharpen({});
  EXPECT_GT(sigma, 0.005);
  EXPECT_LT(sigma, 0.02);
  EXPECT_LT(std::abs(off), 2 * sigma);
  SurveyOptions strict;
  strict.max_whole_lens_sigma = 0.005;
  const auto [strict_off, strict_sigma] = survey.Sharpen(strict);
  EXPECT_GT(std::abs(strict_off), 3 * strict_sigma) << "with the principal point in the middle";
}

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
