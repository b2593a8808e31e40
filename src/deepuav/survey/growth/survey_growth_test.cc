#include "deepuav/survey/growth/survey_growth.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

/// Points that three cameras see, each measured by patches to 0.05 px.
struct MeasuredPoints {
  MeasuredPoints() {
    lens.camera.pinhole = {500, 500, 319.5, 239.5};
    px.resize(3);
    tracks.of_keypoint.resize(3);
    Random random(1);
    for (int t = 0; t < 40; ++t) {
      const Eigen::Vector3d point(random.Uniform(-1, 1), random.Uniform(-1, 1),
                                  random.Uniform(4, 5));
      points.push_back(point);
      Track& track = tracks.tracks.emplace_back();
      for (int view = 0; view < 3; ++view) {
        const auto v = static_cast<size_t>(view);
        px[v].push_back({lens.camera.pinhole.Project(Pose(view) * point), 0.05, true});
        track.sights.push_back({view, t});
        tracks.of_keypoint[v].push_back(t);
      }
    }
  }

  static SE3 Pose(int view) { return {Eigen::Quaterniond::Identity(), {-0.5 * view, 0, 0}}; }

  /// Which sights of a track count once the last one is `off_px` beside its place.
  std::vector<uint8_t> AgreeingOf(size_t track, double off_px, double model_sigma_px) {
    ViewPixels moved = px;
    moved[2][track].px.y() += off_px;
    SurveyState state(tracks, px.size(), lens);
    for (int view = 0; view < 3; ++view)
      state.cam_from_world[static_cast<size_t>(view)] = Pose(view);
    for (size_t t = 0; t < points.size(); ++t) {
      state.points[t] = points[t];
      state.agrees[t].assign(3, 1);
    }
    state.model_sigma_px = model_sigma_px;
    SurveyGrowth growth(&tracks, &moved, lens, {});
    growth.Continue(state);
    return growth.state().agrees[track];
  }

  SurveyLens lens;
  Tracks tracks;
  ViewPixels px;
  std::vector<Eigen::Vector3d> points;
};

TEST(SurveyGrowth, WhatAPatchMeasuredCountsWithinItsNoise) {
  MeasuredPoints survey;
  const std::vector<uint8_t> all = {1, 1, 1}, two = {1, 1, 0};
  EXPECT_EQ(survey.AgreeingOf(7, 0.15, 0.02), all);
  EXPECT_EQ(survey.AgreeingOf(7, 0.5, 0.02), two) << "ten standard deviations";
  EXPECT_EQ(survey.AgreeingOf(7, 0.5, 0.2), all) << "what all err by counts, too";
  EXPECT_EQ(survey.AgreeingOf(7, 0.5, 0), all) << "not known yet";
  for (std::vector<SightPixel>& of_view : survey.px) {
    for (SightPixel& pixel : of_view) pixel = {pixel.px};
  }
  EXPECT_EQ(survey.AgreeingOf(7, 0.5, 0.02), all) << "detected: to a pixel or so";
  EXPECT_EQ(survey.AgreeingOf(7, 4, 0.02), two);
}

}  // namespace
}  // namespace deepuav
