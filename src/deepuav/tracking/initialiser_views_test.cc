// Which views the initialiser holds, and when it gives them up.

#include <gtest/gtest.h>

#include <functional>

#include "deepuav/tracking/testing/initialiser_runs.h"

namespace deepuav {
namespace {

InitialiserOptions FirstViews(int most, int unmatched_frames) {
  InitialiserOptions options;
  options.max_first_views = most;
  options.max_unmatched_frames = unmatched_frames;
  return options;
}

/// Of a path to the side, on which `bad` says of a frame's number whether it shows nothing of the
/// others.
Start FeedSlowly(double step_m, const InitialiserOptions& options, const FeatureNoise& bad_noise,
                 const std::function<bool(int)>& bad) {
  const FeatureWorld world = BoxWorld();
  const FeatureNoise good_noise{0.5, 0.3, 0, 50};
  Random random(5);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), options, {}, &matcher);
  Start start;
  while (start.frames < 120 && !start.request) {
    const SE3 pose = At({step_m * start.frames, 0, 0});
    const FeatureNoise& noise = bad(start.frames) ? bad_noise : good_noise;
    start.request = initialiser.Add(FrameOf(start.frames++, world.View(pose, noise, &random)),
                                    &start.waiting_for);
  }
  return start;
}

TEST(Initialiser, StartsWhereTheCameraIsSlow) {
  const Start start = FeedSlowly(0.006, {}, {}, [](int) { return false; });
  ASSERT_TRUE(start.request) << start.waiting_for;
  EXPECT_GT(start.request->second.id.value, 34) << "its third view comes within 10 frames";
}

TEST(Initialiser, FirstViewsOutlastFramesThatShowNothingOfThem) {
  const FeatureNoise no_matches{.descriptor = 20}, wrong_matches{.swapped_ratio = 0.97};
  const auto starts = [](int most, int unmatched_frames, const FeatureNoise& bad) {
    const auto every_third = [](int frame) { return frame % 3 == 0; };
    return FeedSlowly(0.04, FirstViews(most, unmatched_frames), bad, every_third)
        .request.has_value();
  };
  EXPECT_TRUE(starts(5, 3, no_matches));
  EXPECT_TRUE(starts(5, 3, wrong_matches));
  EXPECT_TRUE(starts(1, 1, no_matches));
  EXPECT_FALSE(starts(1, 0, no_matches)) << "the path is too fast to need what is tested";
}

TEST(Initialiser, AFrameThatMatchesNoFirstViewIsOneToo) {
  const auto first_frame_is_bad = [](int frame) { return frame == 0; };
  const Start several = FeedSlowly(0.04, FirstViews(5, 3), {.descriptor = 20}, first_frame_is_bad);
  ASSERT_TRUE(several.request) << several.waiting_for;
  EXPECT_EQ(several.request->first.id.value, 1);
  const Start one = FeedSlowly(0.04, FirstViews(1, 3), {.descriptor = 20}, first_frame_is_bad);
  ASSERT_TRUE(one.request) << one.waiting_for;
  EXPECT_EQ(one.request->first.id.value, 4) << "the first one is held for three frames";
}

/// What is infinitely far, and things near by: the first ones, or those that come after them.
FeatureWorld FarAndNear(bool first_ones) {
  Random random(3);
  SyntheticWorld geometry;
  geometry.landmarks_world =
      LandmarksInBox(400, {-60'000, -40'000, 90'000}, {60'000, 40'000, 99'000}, &random);
  for (const bool first : {true, false}) {
    const double side = first == first_ones ? 1 : -1;  // ahead, or behind the camera
    for (const auto& near : LandmarksInBox(300, {-6, -4, 8}, {6, 4, 14}, &random))
      geometry.landmarks_world.push_back({near.x(), near.y(), side * near.z()});
  }
  return FeatureWorld(geometry, 2);
}

TEST(Initialiser, AFrameThatLostWhatTheFirstViewSawNearIsAFirstViewToo) {
  const FeatureWorld before = FarAndNear(true), after = FarAndNear(false);
  const auto start_with = [&](double min_first_share) {
    InitialiserOptions options;
    options.min_first_share = min_first_share;
    Random random(5);
    NearestNeighbourMatcher matcher({});
    Initialiser initialiser(before.camera(), options, {}, &matcher);
    Start start;
    while (start.frames < 30 && !start.request) {
      const FeatureWorld& world = start.frames < 3 ? before : after;
      const SE3 pose = At({0.1 * std::max(0, start.frames - 3), 0, 0});
      const SyntheticView view = world.View(pose, {0.3, 0.3, 0, 50}, &random);
      start.request = initialiser.Add(FrameOf(start.frames++, view), &start.waiting_for);
    }
    return start;
  };
  const Start start = start_with(InitialiserOptions().min_first_share);
  ASSERT_TRUE(start.request) << start.waiting_for;
  EXPECT_GE(start.request->first.id.value, 3) << "from then on there is something near by";
  EXPECT_FALSE(start_with(0).request) << "the far away goes on to match the first frame";
}

/// From 40 m, of 67 x 43 m each.
std::vector<SE3> LookingDown(double y, const std::vector<double>& xs) {
  std::vector<SE3> poses;
  for (double x : xs) poses.push_back(LookDown({x, y, 40}, 0));
  return poses;
}

TEST(Initialiser, APairThatNoThirdViewSeesHoldsUpNoOther) {
  std::vector<SE3> poses = LookingDown(-28, {0, 12});
  for (const SE3& pose : LookingDown(28, {12, 24, 32})) poses.push_back(pose);
  const Start start = Feed(GroundWorld(2), poses, {0.5, 0.3, 0, 50});
  ASSERT_TRUE(start.request) << start.waiting_for;
  EXPECT_EQ(start.request->first.id.value, 2);
  EXPECT_EQ(start.request->second.id.value, 3);
  ExpectTrue(*start.request, poses);
}

TEST(Initialiser, ASecondViewIsAFirstOneToo) {
  const std::vector<SE3> poses = LookingDown(0, {-40, -2, 18, 30});
  const Start start = Feed(GroundWorld(2), poses, {0.5, 0.3, 0, 50});
  ASSERT_TRUE(start.request) << start.waiting_for;
  EXPECT_EQ(start.request->first.id.value, 1) << "no view sees with the second what the first saw";
  ExpectTrue(*start.request, poses);
}

TEST(Initialiser, PairsThatNothingIsSeenOfAnyMoreGiveWayToOthers) {
  // Views of which each overlaps its neighbours alone, then three that overlap one another.
  std::vector<SE3> poses = LookingDown(-28, {-60, -26, 8, 42, 76, 110, 144, 178, 212});
  const int64_t sparse = std::ssize(poses);
  for (const SE3& pose : LookingDown(28, {0, 12, 20})) poses.push_back(pose);
  const Start start = Feed(GroundWorld(2, 250, 4800), poses, {0.5, 0.3, 0, 50});
  ASSERT_TRUE(start.request) << start.waiting_for;
  EXPECT_EQ(start.request->first.id.value, sparse);
  ExpectTrue(*start.request, poses);
}

TEST(Initialiser, APairOutlastsABurstOfBlur) {
  const FeatureWorld world = BoxWorld();
  Random random(5);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  std::string waiting_for;
  const auto add = [&](int64_t id, double metres, const FeatureNoise& noise) {
    return initialiser.Add(FrameOf(id, world.View(At({metres, 0, 0}), noise, &random)),
                           &waiting_for);
  };
  const FeatureNoise good{0.5, 0.3, 0, 50}, blurred{.descriptor = 20};
  add(0, 0, good);
  add(20, 1.5, good);
  ASSERT_EQ(waiting_for, "a third view that confirms the first two");
  for (int64_t id = 21; id < 35; ++id) EXPECT_FALSE(add(id, 1.6, blurred));
  EXPECT_NE(waiting_for, "a third view that confirms the first two") << "it shows nothing of them";
  const auto request = add(35, 2.2, good);
  ASSERT_TRUE(request) << waiting_for;
  EXPECT_EQ(request->first.id.value, 0);
  EXPECT_EQ(request->second.id.value, 20);
}

TEST(Initialiser, GivesUpViewsThatGrewOld) {
  const FeatureWorld world = BoxWorld();
  Random random(5);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  const auto add = [&](int64_t id, double metres, std::string* waiting_for) {
    const SyntheticView view = world.View(At({metres, 0, 0}), {0.5, 0.3, 0, 50}, &random);
    return initialiser.Add(FrameOf(id, view), waiting_for);
  };
  std::string waiting_for;
  EXPECT_FALSE(add(0, 0, &waiting_for));
  EXPECT_FALSE(add(121, 1.5, &waiting_for));
  EXPECT_EQ(waiting_for, "a second view");
  EXPECT_FALSE(add(122, 3, &waiting_for));
  EXPECT_EQ(waiting_for, "a third view that confirms the first two");
  EXPECT_FALSE(add(133, 4, &waiting_for)) << "the second view is 11 frames old";
  const auto request = add(134, 5.5, &waiting_for);
  ASSERT_TRUE(request) << waiting_for;
  EXPECT_EQ(request->first.id.value, 121);
  EXPECT_EQ(request->second.id.value, 133);
}

/// Frames of a world, and of one with its points moved along the rays of the first view: with that
/// view, any other of the moved world agrees, and on a false map.
struct FalseMapTest : testing::Test {
  FalseMapTest() : moved_world(Moved()) {}

  FeatureWorld Moved() {
    SyntheticWorld moved = world.world();
    for (Eigen::Vector3d& landmark : moved.landmarks_world) landmark *= random.Uniform(0.6, 1.6);
    return FeatureWorld(moved, 2);
  }

  /// So that the first view and the next true one are a pair, not two later ones.
  static InitialiserOptions WideBaselines() {
    InitialiserOptions options;
    options.two_view.max_distance_sigma = 0.01;
    return options;
  }

  std::optional<InitialMapRequest> Add(const FeatureWorld& seen, int step) {
    poses.push_back(path[static_cast<size_t>(step)]);
    const SyntheticView view = seen.View(poses.back(), {0.3, 0.3, 0, 0}, &random);
    return initialiser.Add(FrameOf(std::ssize(poses) - 1, view), &waiting_for);
  }

  const FeatureWorld world = BoxWorld();
  const std::vector<SE3> path = SidewaysPath(60);
  Random random{5};
  const FeatureWorld moved_world;
  NearestNeighbourMatcher matcher{NearestNeighbourOptions{}};
  Initialiser initialiser{world.camera(), WideBaselines(), {}, &matcher};
  std::vector<SE3> poses;  ///< Of the frames so far.
  std::string waiting_for;
};

TEST_F(FalseMapTest, ViewsThatLaterOnesRefuteAreGivenUp) {
  Add(world, 0);
  Add(moved_world, 20);
  ASSERT_EQ(waiting_for, "a third view that confirms the first two");
  // Two that refute it, from about one place, of which the later one is a second view to the first.
  Add(world, 21);
  Add(world, 22);
  const auto request = Add(world, 50);
  ASSERT_TRUE(request) << "the false pair was held";
  ExpectTrue(*request, poses);
  EXPECT_EQ(request->first.id.value, 0);
  EXPECT_EQ(request->second.id.value, 3);
}

TEST_F(FalseMapTest, ATruePairOutlastsABadView) {
  Add(world, 0);
  Add(world, 20);
  ASSERT_EQ(waiting_for, "a third view that confirms the first two");
  Add(moved_world, 30);
  const auto request = Add(world, 31);
  ASSERT_TRUE(request) << waiting_for;
  EXPECT_EQ(request->second.id.value, 1);
}

}  // namespace
}  // namespace deepuav
