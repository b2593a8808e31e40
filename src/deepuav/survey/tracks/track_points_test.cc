#include "deepuav/survey/tracks/track_points.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr double kHeightM = 40;
constexpr size_t kPoints = 60;

/// Points of the ground, all of which all photographs show.
struct SeenGround {
  explicit SeenGround(const std::vector<SE3>& cam_from_world, double sigma_px = 0.3)
      : poses(cam_from_world), px(cam_from_world.size()) {
    lens.camera.pinhole = {450, 450, 376, 240};
    Random random(1);
    points = LandmarksOnGround(kPoints, {-10, -10}, {10, 10}, 3, &random);
    tracks.tracks.resize(points.size());
    tracks.of_keypoint.resize(poses.size());
    for (size_t v = 0; v < poses.size(); ++v) {
      for (size_t t = 0; t < points.size(); ++t) {
        px[v].push_back({lens.camera.Project(poses[v] * points[t]) +
                         Eigen::Vector2d(random.Gaussian(sigma_px), random.Gaussian(sigma_px))});
        tracks.tracks[t].sights.push_back({static_cast<int>(v), static_cast<int>(t)});
        tracks.of_keypoint[v].push_back(static_cast<int>(t));
      }
    }
  }

  SurveyState State() const {
    SurveyState state(tracks, poses.size(), lens);
    for (size_t v = 0; v < poses.size(); ++v) state.cam_from_world[v] = poses[v];
    return state;
  }
  TrackPoints Points(const SurveyOptions& options = {}) const { return {&tracks, &px, options}; }

  std::vector<SE3> poses;
  ViewPixels px;
  SurveyLens lens;
  Tracks tracks;
  std::vector<Eigen::Vector3d> points;
};

std::vector<SE3> Row(int count, double step_m) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) poses.push_back(LookDown({step_m * i, 0, kHeightM}, 0));
  return poses;
}

TEST(TrackPoints, AWrongSightNeitherMovesThePointNorCounts) {
  SeenGround ground(Row(5, 4));
  ground.px[2][7].px += Eigen::Vector2d(30, 25);
  SurveyState state = ground.State();
  EXPECT_EQ(ground.Points().TriangulateAll(&state), static_cast<int>(kPoints));
  for (size_t t = 0; t < kPoints; ++t) {
    ASSERT_TRUE(state.points[t]);
    EXPECT_LT((*state.points[t] - ground.points[t]).norm(), 0.03 * kHeightM) << t;
  }
  EXPECT_EQ(state.agrees[7], (std::vector<uint8_t>{1, 1, 0, 1, 1}));
}

TEST(TrackPoints, AreNoneWithoutParallaxOrInFrontOfNobody) {
  const auto found = [](const SeenGround& ground) {
    SurveyState state = ground.State();
    return ground.Points().TriangulateAll(&state);
  };
  std::vector<SE3> turning;
  for (int i = 0; i < 6; ++i) turning.push_back(LookDown({0, 0, kHeightM}, 0.5 * i));
  EXPECT_EQ(found(SeenGround(turning)), 0);
  constexpr double kHalfADegreeM = 0.0087 * kHeightM;
  EXPECT_EQ(found(SeenGround(Row(2, kHalfADegreeM), 0)), 0);
  EXPECT_EQ(found(SeenGround(Row(2, 4 * kHalfADegreeM), 0)), static_cast<int>(kPoints));
  SeenGround behind(Row(3, 4), 0);
  for (size_t v = 0; v < behind.poses.size(); ++v) {
    // It looks up; its rays, lengthened backwards, meet the points.
    behind.poses[v] = SE3(RotationExp({M_PI, 0, 0}), Eigen::Vector3d::Zero()) * behind.poses[v];
    for (SightPixel& sight : behind.px[v])
      sight.px.x() = 2 * behind.lens.camera.pinhole.cx - sight.px.x();
  }
  EXPECT_EQ(found(behind), 0);
}

TEST(TrackPoints, JudgingTakesPointsAwayThatNoLongerAgreeOnce) {
  const SeenGround ground(Row(3, 4));
  SurveyState state = ground.State();
  const TrackPoints points = ground.Points();
  points.TriangulateAll(&state);
  EXPECT_EQ(points.Judge(&state), 0);
  state.cam_from_world[2].reset();
  EXPECT_EQ(points.Judge(&state), static_cast<int>(kPoints)) << "one sight each";
  EXPECT_TRUE(
      std::ranges::all_of(state.points, [](const auto& point) { return point.has_value(); }));
  state.cam_from_world[1] = Row(2, 9)[1];
  EXPECT_GE(points.Judge(&state), static_cast<int>(kPoints));
  for (size_t t = 0; t < kPoints; ++t) {
    EXPECT_FALSE(state.points[t]);
    EXPECT_EQ(std::ranges::count(state.agrees[t], 0), 3);
  }
  EXPECT_EQ(points.Judge(&state), 0);
}

TEST(TrackPoints, JudgingTakesPointsAwayThatAgreeWithoutParallax) {
  std::vector<SE3> turning;
  for (int i = 0; i < 3; ++i) turning.push_back(LookDown({0, 0, kHeightM}, 0.5 * i));
  const SeenGround ground(turning);
  SurveyState state = ground.State();
  for (size_t t = 0; t < kPoints; ++t) {
    state.points[t] = ground.points[t];
    state.agrees[t].assign(turning.size(), 1);
  }
  EXPECT_EQ(ground.Points().Judge(&state), static_cast<int>(kPoints)) << "it says that some went";
  for (size_t t = 0; t < kPoints; ++t) EXPECT_FALSE(state.points[t]) << t;
}

TEST(TrackPoints, ALensThatIsHardlyKnownErrsByMore) {
  constexpr double kOffPx = 6;  // twice what counts, but not thrice
  for (const int views : {4, 5}) {
    SeenGround ground(Row(views, 3), 0);
    ground.px[0][9].px.y() += kOffPx;
    for (const bool is_refined : {false, true}) {
      ground.lens.is_refined = is_refined;
      SurveyState state = ground.State();
      for (size_t t = 0; t < kPoints; ++t) state.points[t] = ground.points[t];
      ground.Points().Judge(&state);
      EXPECT_EQ(state.agrees[9][0] != 0, is_refined && views == 4) << views;
      EXPECT_TRUE(state.agrees[9][1]);
    }
  }
}

TEST(TrackPoints, AreTheSameOnAnyNumberOfThreads) {
  const SeenGround ground(Row(5, 4), 1.5);
  const auto found = [&](int threads) {
    SurveyOptions options;
    options.threads = threads;
    SurveyState state = ground.State();
    ground.Points(options).TriangulateAll(&state);
    return state;
  };
  const SurveyState alone = found(1), together = found(7);
  EXPECT_EQ(alone.points, together.points);
  EXPECT_EQ(alone.agrees, together.agrees);
}

TEST(TrackPoints, PhotographsTakenWhereItHoveredDoNotHideTheOthers) {
  std::vector<SE3> poses(8, LookDown({0, 0, kHeightM}, 0));
  for (const SE3& pose : Row(3, 6)) poses.push_back(pose);
  const SeenGround ground(poses);
  SurveyState state = ground.State();
  EXPECT_EQ(ground.Points().TriangulateAll(&state), static_cast<int>(kPoints));
}

}  // namespace
}  // namespace deepuav
