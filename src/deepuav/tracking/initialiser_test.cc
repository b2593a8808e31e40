#include "deepuav/tracking/initialiser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/tracking/testing/initialiser_runs.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

TEST(Initialiser, StartsInAGeneralScene) {
  const std::vector<SE3> poses = SidewaysPath(40);
  const FeatureWorld world = BoxWorld();
  const Start start = Feed(world, poses, {0.5, 0.3, 0, 50});
  ASSERT_TRUE(start.request) << start.waiting_for;
  EXPECT_GE(start.frames, 3);
  ExpectTrue(*start.request, poses);
}

TEST(Initialiser, PointsLieWhereTheyAre) {
  const std::vector<SE3> poses = SidewaysPath(40);
  const FeatureWorld world = BoxWorld();
  Random random(5);
  std::vector<SyntheticView> views;
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  std::optional<InitialMapRequest> request;
  std::string waiting_for;
  for (size_t i = 0; i < poses.size() && !request; ++i) {
    views.push_back(world.View(poses[i], {0.3, 0.3, 0, 50}, &random));
    request = initialiser.Add(FrameOf(static_cast<int64_t>(i), views.back()), &waiting_for);
  }
  ASSERT_TRUE(request);
  const auto first = static_cast<size_t>(request->first.id.value);
  const auto second = static_cast<size_t>(request->second.id.value);
  const SE3 truth = poses[second] * poses[first].Inverse();
  const double scale = truth.translation().norm() / request->second_from_first.translation().norm();
  int far_off = 0;
  for (const InitialMapRequest::Point& point : request->points) {
    const int landmark = views[first].landmark[static_cast<size_t>(point.keypoint_first)];
    ASSERT_EQ(landmark, views[second].landmark[static_cast<size_t>(point.keypoint_second)]);
    ASSERT_GE(landmark, 0);
    const Eigen::Vector3d position =
        poses[first] * world.landmarks()[static_cast<size_t>(landmark)];
    const Eigen::Vector3d estimate = scale * point.position_first;
    EXPECT_LT(estimate.normalized().cross(position.normalized()).norm(), 0.01) << "direction";
    far_off += (estimate - position).norm() > 0.2 * position.norm();
  }
  EXPECT_LT(far_off, 0.2 * static_cast<double>(request->points.size()));
}

TEST(Initialiser, StartsOverAPlaneSeenStraightDown) {
  for (const double relief : {0.0, 2.0}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      const std::vector<SE3> poses = NadirPath(60);
      const Start start = Feed(GroundWorld(relief), poses, {0.5, 0.3, 0, 50}, seed);
      ASSERT_TRUE(start.request) << start.waiting_for << ", relief " << relief;
      ExpectTrue(*start.request, poses);
    }
  }
}

/// Ground ahead, and clouds and a horizon as good as infinitely far above it, from a camera that
/// looks ahead and a little down.
FeatureWorld AheadWorld() {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksOnGround(400, {8, -60}, {150, 60}, 0.5, &random);
  for (const auto& far :
       LandmarksInBox(900, {90'000, -90'000, 0}, {100'000, 90'000, 60'000}, &random))
    geometry.landmarks_world.push_back(far);
  return FeatureWorld(geometry, 2);
}

TEST(Initialiser, StartsLookingAheadUnderASky) {
  for (const Eigen::Vector3d& step_m :
       {Eigen::Vector3d(0.5, 0, 0), Eigen::Vector3d(0, 0, 0.3), Eigen::Vector3d(0.3, 0.05, -0.1)}) {
    std::vector<SE3> poses;
    for (int i = 0; i < 30; ++i) {
      const Eigen::Vector3d centre = Eigen::Vector3d(0, 0, 10) + i * step_m;
      poses.push_back(LookAt(centre, centre + Eigen::Vector3d(1, 0.002 * i, -0.17), {0, 0, 1}));
    }
    const Start start = Feed(AheadWorld(), poses, {0.3, 0.3, 0, 50});
    ASSERT_TRUE(start.request) << start.waiting_for;
    ExpectTrue(*start.request, poses);
    for (const InitialMapRequest::Point& point : start.request->points)
      EXPECT_LT(point.position_first.norm() * start.request->second.id.value * step_m.norm(), 1000)
          << "no cloud is a landmark";
  }
}

TEST(Initialiser, StandsThirtyPercentWrongMatchesAndNoise) {
  const std::vector<SE3> poses = SidewaysPath(50);
  const double right_in_one_view = std::sqrt(0.7);  // a match needs the right descriptor in two
  const Start start = Feed(BoxWorld(), poses, {0.7, 0.4, 1 - right_in_one_view, 100});
  ASSERT_TRUE(start.request) << start.waiting_for;
  ExpectTrue(*start.request, poses);
}

TEST(Initialiser, NeverStartsFromPureRotation) {
  for (const double sigma_px : {0.0, 0.5, 1.0}) {
    std::vector<SE3> poses;
    for (int i = 0; i < 80; ++i)
      poses.emplace_back(RotationExp({0.002 * i, 0.008 * i, 0}), Eigen::Vector3d::Zero());
    const Start start = Feed(BoxWorld(), poses, {sigma_px, 0.3, 0, 20});
    EXPECT_FALSE(start.request) << sigma_px;
    EXPECT_FALSE(start.waiting_for.empty());
  }
}

TEST(Initialiser, NeverStartsFromACameraThatHovers) {
  for (const bool plane : {false, true}) {
    const std::vector<SE3> poses(80, plane ? LookDown({0, 0, 40}, 0) : SE3());
    const Start start = Feed(plane ? GroundWorld(0) : BoxWorld(), poses, {0.7, 0.3, 0, 20});
    EXPECT_FALSE(start.request);
  }
}

TEST(Initialiser, SaysWhatIsMissing) {
  Random random(1);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(BoxWorld().camera(), {}, {}, &matcher);
  const auto add = [&](int64_t id, int keypoints) {
    const SyntheticView view{std::make_shared<const Features>(RandomFeatures(
                                 keypoints, 752, 480, FeatureWorld::kDimension, &random)),
                             {}};
    std::string waiting_for;
    EXPECT_FALSE(initialiser.Add(FrameOf(id, view), &waiting_for));
    return waiting_for;
  };
  EXPECT_EQ(add(0, 0), "key points: 0 of at least 100");
  EXPECT_EQ(add(1, 99), "key points: 99 of at least 100");
  EXPECT_EQ(add(2, 300), "a second view");
  EXPECT_THAT(add(3, 300), testing::MatchesRegex("matches: [0-9]+ of at least 60"));
}

TEST(Initialiser, StartsFromALaterViewWhereTheFirstOnesShowNothing) {
  const FeatureWorld world = BoxWorld();
  const std::vector<SE3> poses = SidewaysPath(60);
  Random random(8);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  std::optional<InitialMapRequest> request;
  std::string waiting_for;
  for (int i = 0; i < 60 && !request; ++i) {
    SyntheticView view = world.View(poses[static_cast<size_t>(i)], {0.5, 0.3, 0, 50}, &random);
    if (i < 10) {
      view.features = std::make_shared<const Features>(
          RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random));
    }
    request = initialiser.Add(FrameOf(i, view), &waiting_for);
  }
  ASSERT_TRUE(request) << waiting_for;
  EXPECT_GE(request->first.id.value, 10);
  ExpectTrue(*request, poses);
}

TEST(Initialiser, ForgetsItsViewsOnReset) {
  const FeatureWorld world = BoxWorld();
  Random random(9);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  std::string waiting_for;
  initialiser.Add(FrameOf(0, world.View(SE3(), {}, &random)), &waiting_for);
  initialiser.Add(FrameOf(1, world.View(At({0.01, 0, 0}), {}, &random)), &waiting_for);
  EXPECT_EQ(waiting_for, "parallax");
  initialiser.Reset();
  initialiser.Add(FrameOf(2, world.View(At({2, 0, 0}), {}, &random)), &waiting_for);
  EXPECT_EQ(waiting_for, "a second view");
}

TEST(Initialiser, DoesNotGiveTheSameViewsAgain) {
  const FeatureWorld world = BoxWorld();
  const std::vector<SE3> poses = SidewaysPath(60);
  Random random(10);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  std::vector<int64_t> seconds;
  std::string waiting_for;
  for (int i = 0; i < 60 && seconds.size() < 2; ++i) {
    const auto view = world.View(poses[static_cast<size_t>(i)], {0.5, 0.3, 0, 50}, &random);
    const auto request = initialiser.Add(FrameOf(i, view), &waiting_for);
    if (request) seconds.push_back(request->second.id.value);
  }
  ASSERT_EQ(seconds.size(), 2u);
  EXPECT_LT(seconds[0], seconds[1]) << "a pair that did not hold as a map is tried once";
}

TEST(InitialiserOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(InitialiserOptions().Check());
  EXPECT_THROW(OptionsWith(&InitialiserOptions::min_keypoints, 7).Check(), Error);
  EXPECT_THROW(OptionsWith(&InitialiserOptions::max_first_age_frames, 1).Check(), Error);
  EXPECT_THROW(OptionsWith(&InitialiserOptions::max_first_views, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&InitialiserOptions::max_unmatched_frames, -1).Check(), Error);
  EXPECT_THROW(OptionsWith(&InitialiserOptions::max_pairs, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&InitialiserOptions::min_confirmed_ratio, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&InitialiserOptions::min_lead, 0.5).Check(), Error);
}

}  // namespace
}  // namespace deepuav
