#include "deepuav/tracking/initialiser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "deepuav/base/error.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/options_with.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

FeatureWorld BoxWorld() {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(900, {-14, -8, 8}, {18, 8, 25}, &random);
  return FeatureWorld(geometry, 2);
}

FeatureWorld GroundWorld(double relief, double to_x = 90, int landmarks = 1200) {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksOnGround(landmarks, {-70, -50}, {to_x, 50}, relief, &random);
  return FeatureWorld(geometry, 2);
}

struct Start {
  std::optional<InitialMapRequest> request;
  int frames = 0;
  std::string waiting_for;
};

Start Feed(const FeatureWorld& world, const std::vector<SE3>& poses, const FeatureNoise& noise,
           uint64_t seed = 5) {
  Random random(seed);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
  Start start;
  for (const SE3& pose : poses) {
    const SyntheticView view = world.View(pose, noise, &random);
    start.request = initialiser.Add(FrameOf(start.frames++, view), &start.waiting_for);
    if (start.request) break;
  }
  return start;
}

void ExpectTrue(const InitialMapRequest& request, const std::vector<SE3>& poses) {
  const SE3& first = poses[static_cast<size_t>(request.first.id.value)];
  const SE3& second = poses[static_cast<size_t>(request.second.id.value)];
  const SE3 truth = second * first.Inverse();
  EXPECT_LT((request.second_from_first * truth.Inverse()).Angle(), 0.01);
  const double cosine =
      request.second_from_first.translation().normalized().dot(truth.translation().normalized());
  EXPECT_GT(cosine, std::cos(0.1)) << "direction of travel";
  EXPECT_GT(request.points.size(), 60u);
}

std::vector<SE3> SidewaysPath(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) {
    poses.push_back(SE3(RotationExp({0.001 * i, -0.002 * i, 0}), {-0.12 * i, 0.01 * i, 0.02 * i}));
  }
  return poses;
}

std::vector<SE3> NadirPath(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) poses.push_back(LookDown({0.5 * i, 0.05 * i, 40}, 0.01 * i));
  return poses;
}

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
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
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
  Initialiser initialiser({450, 450, 376, 240}, {}, &matcher);
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
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
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
  Initialiser initialiser(world.world().pinhole, options, &matcher);
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
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
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
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
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
  Initialiser initialiser{world.world().pinhole, WideBaselines(), &matcher};
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

TEST(Initialiser, ForgetsItsViewsOnReset) {
  const FeatureWorld world = BoxWorld();
  Random random(9);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
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
  Initialiser initialiser(world.world().pinhole, {}, &matcher);
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
