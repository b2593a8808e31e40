#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/survey/growth/survey_growth.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr double kWidthPx = 1155, kHeightPx = 866, kFocalPx = 940, kK1 = -0.25, kK2 = 0.08;

/// One line of photographs straight down over hills, of which three in a row share points: it bends
/// under a wrong lens, by little for each photograph.
struct Strip {
  Strip() {
    constexpr int kViews = 60, kPoints = 3500;
    constexpr double kStepM = 14, kLengthM = kViews * kStepM, kAboveM = 50, kReliefM = 8;
    Random random(1);
    lens.camera.pinhole = {kFocalPx, kFocalPx, kWidthPx / 2, kHeightPx / 2};
    lens.camera.k1 = kK1;
    lens.camera.k2 = kK2;
    points = LandmarksOnGround(kPoints, {-30, -30}, {kLengthM + 30, 30}, kReliefM, &random);
    for (int i = 0; i < kViews; ++i)
      poses.push_back(Perturbed(LookDown({kStepM * i, 0, kAboveM}, M_PI / 2), 0.5, 0.03, &random));
    px.resize(poses.size());
    tracks.of_keypoint.resize(poses.size());
    for (const Eigen::Vector3d& point : points) Show(point, &random);
  }

  void Show(const Eigen::Vector3d& point, Random* random) {
    constexpr double kSigmaPx = 0.05;
    const int t = static_cast<int>(tracks.tracks.size());
    Track& track = tracks.tracks.emplace_back();
    for (size_t v = 0; v < poses.size(); ++v) {
      const Eigen::Vector2d at = lens.camera.Project(poses[v] * point);
      if (!lens.Reaches(poses[v] * point)) continue;
      if (at.x() < 0 || at.y() < 0 || at.x() > kWidthPx || at.y() > kHeightPx) continue;
      track.sights.push_back({static_cast<int>(v), static_cast<int>(px[v].size())});
      tracks.of_keypoint[v].push_back(t);
      px[v].push_back({at + Eigen::Vector2d(random->Gaussian(kSigmaPx), random->Gaussian(kSigmaPx)),
                       kSigmaPx, true});
    }
  }

  SurveyLens lens;
  std::vector<Eigen::Vector3d> points;
  std::vector<SE3> poses;
  Tracks tracks;
  ViewPixels px;
};

/// Straight from bent: the line as an arc of `kRadiusM`, upwards.
SE3 BentAt(double x_m) {
  constexpr double kRadiusM = 500;
  const double angle = x_m / kRadiusM;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d on_arc(kRadiusM * std::sin(angle), 0, kRadiusM * (1 - std::cos(angle)));
  return SE3(turn, on_arc - turn * Eigen::Vector3d(x_m, 0, 0)).Inverse();
}

TEST(SurveyGrowth, AStripIsAdjustedUntilItBendsNoMore) {
  const Strip strip;
  SurveyLens wrong;
  wrong.is_refined = true;
  wrong.focal_sigma = 0.5;
  wrong.camera.pinhole = strip.lens.camera.pinhole;
  wrong.camera.pinhole.fx = wrong.camera.pinhole.fy = wrong.focal_guess_px = 0.7 * kFocalPx;
  SurveyState state(strip.tracks, strip.poses.size(), wrong);
  for (size_t v = 0; v < strip.poses.size(); ++v)
    state.cam_from_world[v] = strip.poses[v] * BentAt(strip.poses[v].InverseTranslation().x());
  state.model_sigma_px = 0.02;
  SurveyOptions options;
  options.max_patch_sigmas = 1000;  // Under the wrong lens all is beside its place.
  SurveyGrowth growth(&strip.tracks, &strip.px, wrong, options);
  growth.Resume(state);
  growth.Settle(nullptr);
  growth.Finish(nullptr);
  EXPECT_NEAR(growth.state().lens.camera.pinhole.fx, kFocalPx, 0.005 * kFocalPx);
  EXPECT_NEAR(growth.state().lens.camera.k1, kK1, 0.005);
}

}  // namespace
}  // namespace deepuav
