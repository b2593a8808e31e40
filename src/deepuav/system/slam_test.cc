#include "deepuav/system/slam.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/system/testing/slam_runs.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

TEST(Slam, FollowsAFlightFromTheFirstFrameToTheLast) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(80), kNoise, 3);
  const Outcome run = Fly(flight);
  EXPECT_EQ(run.result.failure, "");
  EXPECT_FALSE(run.result.stopped);
  ASSERT_EQ(run.result.frames.size(), 80u);
  EXPECT_EQ(Located(run.result), 80);
  EXPECT_EQ(run.slam->atlas().Remaining().size(), 1u);
  EXPECT_LT(PathError(run.result, flight), 0.05) << "over 12 m";
  const FrameRecord& first = run.result.frames.front();
  EXPECT_FALSE(first.tracked_online);
  EXPECT_TRUE(first.located()) << "frames before the map's beginning are located at the end";
  int online = 0;
  for (const FrameRecord& record : run.result.frames) {
    online += record.tracked_online;
    EXPECT_EQ(record.time, Timestamp{record.id.value * 50'000'000});
    EXPECT_FALSE(record.features) << "a frame with a pose needs them no more";
  }
  EXPECT_GT(online, 60);
  for (const char* stage : {"decode", "network", "key points", "track"}) {
    EXPECT_EQ(run.result.stage_durations_s.at(stage).size(), 80u) << stage;
  }
}

TEST(Slam, TheTrajectoryHoldsThePosesOfKeyframes) {
  const Outcome run = Fly(MakeFlight(BoxWorld(), WeavingPath(80), kNoise, 3));
  int keyframes = 0;
  run.slam->atlas().At({0}).keyframes().ForEach([&](const Keyframe& keyframe) {
    const FrameRecord& record = run.result.frames[static_cast<size_t>(keyframe.frame.id.value)];
    if (!record.tracked_online) return;
    ++keyframes;
    EXPECT_EQ(record.pose.keyframe, keyframe.id);
    EXPECT_EQ(record.cam_from_world.translation(), keyframe.cam_from_world.translation());
  });
  EXPECT_GT(keyframes, 3);
}

TEST(Slam, LocatesFramesThatSeeLittleAgainInTheFinishedMap) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(80), kNoise, 3);
  const auto run_with = [&](double share) {
    SystemOptions options = OptionsWith(&SystemOptions::min_neighbour_share, share);
    options.young_map_frames = 0;  // Else the first ones are located again either way.
    return Fly(flight, Schedule::kSequential, options);
  };
  const Outcome never = run_with(0), whenever_less = run_with(1);
  int seen_before = 0, seen_after = 0;
  for (size_t i = 0; i < never.result.frames.size(); ++i) {
    const FrameRecord &before = never.result.frames[i], &after = whenever_less.result.frames[i];
    EXPECT_EQ(before.tracked_online, after.tracked_online);
    EXPECT_FALSE(after.features);
    EXPECT_GE(after.landmark_count, before.landmark_count) << i;
    seen_before += before.landmark_count;
    seen_after += after.landmark_count;
  }
  EXPECT_GT(seen_after, seen_before);
  EXPECT_LT(PathError(whenever_less.result, flight), 1.02 * PathError(never.result, flight));
}

TEST(Slam, FollowsAFlightOverGroundSeenStraightDown) {
  for (const double relief : {0.0, 2.0}) {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksOnGround(900, {-50, -40}, {100, 50}, relief, &random);
    std::vector<SE3> path;
    for (int i = 0; i < 80; ++i) {
      path.push_back(LookDown({0.6 * i, 3 * std::sin(0.05 * i), 40}, 0.01 * i));
    }
    const SyntheticFlight flight = MakeFlight(FeatureWorld(geometry, 2), path, kNoise, 16);
    const Outcome run = Fly(flight);
    EXPECT_EQ(run.slam->atlas().Remaining().size(), 1u);
    EXPECT_EQ(Located(run.result), 80);
    EXPECT_LT(PathError(run.result, flight), 0.3) << "over 48 m, relief " << relief;
  }
}

TEST(Slam, SequentialAndThreadedAgreeToTheByteEveryTime) {
  const FeatureWorld world = BoxWorld();
  SyntheticFlight flight = MakeFlight(world, WeavingPath(70), {0.6, 0.4, 0.1, 40}, 4);
  Random random(9);
  for (size_t i = 30; i < 34; ++i) flight.features[i] = RandomFeatures(200, 752, 480, 64, &random);
  const std::string sequential = Bytes(Fly(flight, Schedule::kSequential).result);
  EXPECT_EQ(Bytes(Fly(flight, Schedule::kSequential).result), sequential);
  EXPECT_EQ(Bytes(Fly(flight, Schedule::kThreaded).result), sequential);
  EXPECT_EQ(Bytes(Fly(flight, Schedule::kThreaded).result), sequential);
  for (const int delay : {2, 5}) {
    const auto options = OptionsWith(&SystemOptions::map_delay_frames, delay);
    const std::string delayed = Bytes(Fly(flight, Schedule::kSequential, options).result);
    EXPECT_EQ(Bytes(Fly(flight, Schedule::kThreaded, options).result), delayed) << delay;
    EXPECT_NE(delayed, sequential);
  }
}

/// Nearest neighbours, watched.
class WatchedMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    if (busy_.exchange(true)) asked_by_two_at_once = true;
    ++asked;
    auto matches = matcher_.MatchFeatures(a, b);
    busy_ = false;
    return matches;
  }
  std::string Description() const override { return "watched"; }

  std::atomic<int> asked{0};
  std::atomic<bool> asked_by_two_at_once{false};

 private:
  NearestNeighbourMatcher matcher_{{}};
  std::atomic<bool> busy_{false};
};

TEST(Slam, ALearnedMatcherServesTrackingAndMappingFromTheirThreads) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(80), kNoise, 4);
  SystemOptions options;
  options.mapping.creation.learned_neighbours = 3;
  const auto fly = [&](Schedule schedule, bool is_learned) {
    PreparedFeatures extractor(flight.features);
    WatchedMatcher matcher;
    NumberedImages images(flight.size(), flight.frame_interval_s, -1);
    Perception perception{&extractor, &matcher};
    perception.matcher_is_learned = is_learned;
    const std::string bytes =
        Bytes(Slam(flight.camera, options, perception).Run(&images, schedule));
    EXPECT_FALSE(matcher.asked_by_two_at_once);
    return std::pair(bytes, matcher.asked.load());
  };
  const auto [sequential, asked] = fly(Schedule::kSequential, true);
  EXPECT_EQ(fly(Schedule::kThreaded, true).first, sequential);
  EXPECT_GT(asked, fly(Schedule::kSequential, false).second + 10) << "between keyframes, too";
}

TEST(Slam, LocatesNothingAtTheEndWhereNoGapMayBeBridged) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(60), kNoise, 7);
  SystemOptions options;
  options.max_gap_frames = 0;
  const Outcome run = Fly(flight, Schedule::kSequential, options);
  EXPECT_GT(Located(run.result), 0);
  for (const FrameRecord& record : run.result.frames)
    EXPECT_EQ(record.located(), record.tracked_online) << record.id.value;
  EXPECT_GT(Located(Fly(flight).result), Located(run.result));
}

TEST(Slam, StartsASecondMapWhenLostForLong) {
  const FeatureWorld world = BoxWorld();
  SyntheticFlight flight = MakeFlight(world, WeavingPath(130), kNoise, 8);
  Random random(9);
  for (size_t i = 45; i < 80; ++i) flight.features[i] = RandomFeatures(250, 752, 480, 64, &random);
  const Outcome run = Fly(flight);
  ASSERT_EQ(run.slam->atlas().Remaining().size(), 2u);
  for (const FrameRecord& record : run.result.frames) {
    const int64_t id = record.id.value;
    const bool blind = id >= 45 && id < 80;
    EXPECT_EQ(record.located(), !blind) << id;
    if (blind) {
      EXPECT_THAT(record.reason, testing::MatchesRegex("(no pose from 250|waiting for ).*")) << id;
      continue;
    }
    EXPECT_EQ(record.map, MapId{id < 45 ? 0 : 1}) << id;
  }
  EXPECT_LT(PathError(run.result, flight, {0}), 0.05);
  EXPECT_LT(PathError(run.result, flight, {1}), 0.05);
}

TEST(Slam, FindsBackWhenLostForAMoment) {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(80), kNoise, 10);
  Random random(9);
  for (size_t i = 45; i < 60; ++i) flight.features[i] = RandomFeatures(250, 752, 480, 64, &random);
  const Outcome run = Fly(flight);
  EXPECT_EQ(run.slam->atlas().Remaining().size(), 1u);
  EXPECT_EQ(Located(run.result), 80 - 15);
  EXPECT_LT(PathError(run.result, flight), 0.05);
}

TEST(Slam, StandsWrongMatchesAndNoise) {
  const FeatureWorld world = BoxWorld();
  for (const double wrong_matches : {0.2, 0.4}) {
    const double swapped = 1 - std::sqrt(1 - wrong_matches);
    SyntheticFlight flight = MakeFlight(world, WeavingPath(70), {1, 0.5, swapped, 100}, 11);
    // Starting demands more agreement than going on does.
    const SyntheticFlight clean = MakeFlight(world, WeavingPath(20), kNoise, 11);
    std::copy(clean.features.begin(), clean.features.end(), flight.features.begin());
    const Outcome run = Fly(flight);
    EXPECT_EQ(run.slam->atlas().Remaining().size(), 1u);
    EXPECT_EQ(Located(run.result), 70) << wrong_matches;
    EXPECT_LT(PathError(run.result, flight), 0.15) << wrong_matches;
  }
}

TEST(Slam, PureRotationNeverStartsAMap) {
  std::vector<SE3> path;
  for (int i = 0; i < 60; ++i)
    path.emplace_back(RotationExp({0.002 * i, 0.01 * i, 0}), Eigen::Vector3d::Zero());
  const Outcome run = Fly(MakeFlight(BoxWorld(), path, kNoise, 13));
  EXPECT_TRUE(run.slam->atlas().Remaining().empty());
  EXPECT_EQ(Located(run.result), 0);
  for (const FrameRecord& record : run.result.frames) {
    EXPECT_THAT(record.reason, testing::StartsWith("waiting for "));
  }
}

TEST(Slam, SurvivesFramesWithoutKeypoints) {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(60), kNoise, 15);
  for (size_t i : {0u, 1u, 30u, 31u, 59u}) flight.features[i] = Features{{}, Descriptors(64)};
  const Outcome run = Fly(flight, Schedule::kThreaded);
  EXPECT_EQ(run.result.failure, "");
  // The two in mid-flight are placed between their neighbours.
  EXPECT_EQ(Located(run.result), 57);
  EXPECT_TRUE(run.result.frames[30].inferred);
  EXPECT_EQ(run.result.frames[30].reason, "no pose from 0 key points");
  EXPECT_LT(PathError(run.result, flight), 0.05);
}

TEST(ParseSchedule, KnowsThreeNames) {
  EXPECT_EQ(ParseSchedule("sequential"), Schedule::kSequential);
  EXPECT_EQ(ParseSchedule("threaded"), Schedule::kThreaded);
  EXPECT_EQ(ParseSchedule("live"), Schedule::kLive);
  EXPECT_THROW(ParseSchedule("Live"), Error);
}

TEST(SystemOptions, AreAllRegisteredOnceAndChecked) {
  SystemOptions options;
  OptionRegistry registry;
  RegisterOptions(&options, &registry);
  EXPECT_GT(registry.entries().size(), 50u);
  registry.Set("tracking.max_lost_frames", "7");
  registry.Set("mapping.creation.min_parallax_deg", "2.5");
  EXPECT_EQ(options.tracking.max_lost_frames, 7);
  EXPECT_EQ(options.mapping.creation.min_parallax_deg, 2.5);
  EXPECT_NO_THROW(options.Check());
  registry.Set("mapping.epipolar.ratio", "0");
  EXPECT_THROW(options.Check(), Error);
  registry.Set("mapping.epipolar.ratio", "0.8");
  registry.Set("sensors.gnss.correlation_s", "-1");
  EXPECT_THAT([&] { options.Check(); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("sensors.gnss.correlation_s")));
  EXPECT_THROW(OptionsWith(&SystemOptions::map_delay_frames, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&SystemOptions::frames_ahead, 0).Check(), Error);
}

}  // namespace
}  // namespace deepuav
