// What the whole system makes of places seen again: loops, jumps, maps that meet.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"
#include "support/path_error.h"
#include "support/synthetic_court.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.2, 0, 20};
SyntheticFlight Blind(int frames) {
  Random random(77);
  SyntheticFlight flight;
  for (int i = 0; i < frames; ++i) {
    flight.cam_from_world.push_back(SE3());
    flight.features.push_back(RandomFeatures(250, 752, 480, FeatureWorld::kDimension, &random));
  }
  return flight;
}

struct Outcome {
  SlamResult result;
  std::vector<MapId> maps;
};

Outcome Fly(const SyntheticFlight& flight, const Vocabulary* vocabulary,
            Schedule schedule = Schedule::kSequential, Matcher* quick_matcher = nullptr,
            const SystemOptions& options = {}) {
  PreparedFeatures extractor(flight.features);
  NearestNeighbourMatcher matcher({});
  NumberedImages images(flight.size(), flight.frame_interval_s);
  Slam slam(flight.camera, options, {&extractor, &matcher, vocabulary, nullptr, quick_matcher});
  SlamResult result = slam.Run(&images, schedule);
  EXPECT_EQ(result.failure, "");
  return {std::move(result), slam.atlas().Remaining()};
}

int LocatedIn(const Outcome& run, MapId map) {
  int located = 0;
  for (const FrameRecord& record : run.result.frames) located += record.map == map;
  return located;
}

double PathError(const Outcome& run, const SyntheticFlight& flight, MapId map) {
  std::vector<Eigen::Vector3d> estimate, truth;
  for (const FrameRecord& record : run.result.frames) {
    if (record.map != map) continue;
    estimate.push_back(record.cam_from_world.InverseTranslation());
    truth.push_back(
        flight.cam_from_world[static_cast<size_t>(record.id.value)].InverseTranslation());
  }
  return RmseAfterAlignment(estimate, truth);
}

std::string Bytes(const SlamResult& result) {
  std::string bytes;
  for (const FrameRecord& record : result.frames) {
    const SE3& pose = record.cam_from_world;
    bytes.append(reinterpret_cast<const char*>(pose.rotation().coeffs().data()), 32);
    bytes.append(reinterpret_cast<const char*>(pose.translation().data()), 24);
    bytes += std::to_string(record.map.value) + " ";
  }
  return bytes;
}

TEST(SlamPlaces, ClosesALoopAndLosesTheDrift) {
  const FeatureWorld world = Court(1);
  SyntheticFlight flight = MakeFlight(world, Walk(0, kLap + 60), kNoise, 3);
  flight.camera.pinhole.fx *= 1.04;  // a wrong calibration drifts
  flight.camera.pinhole.fy *= 1.04;
  const Vocabulary vocabulary = VocabularyOf(flight);
  SystemOptions options;
  options.mapping.lens.enabled = false;  // which would take up half of it
  const auto fly = [&](const Vocabulary* places) {
    return Fly(flight, places, Schedule::kSequential, nullptr, options);
  };
  const Outcome without = fly(nullptr), with = fly(&vocabulary);
  EXPECT_EQ(without.result.closed_loops, 0);
  EXPECT_GE(with.result.closed_loops, 1);
  ASSERT_EQ(with.maps.size(), 1u);
  EXPECT_EQ(LocatedIn(with, with.maps[0]), flight.size());
  const double drifting = PathError(without, flight, without.maps[0]);
  const double closed = PathError(with, flight, with.maps[0]);
  EXPECT_LT(closed, 0.5 * drifting) << "without: " << drifting;
  EXPECT_LT(closed, 0.05);
}

TEST(SlamPlaces, IsFoundAgainAfterAJumpInItsMap) {
  const FeatureWorld world = Court(2);
  SyntheticFlight flight = MakeFlight(world, Walk(0, 100), kNoise, 3);
  Append(MakeFlight(world, Walk(0.1, 60), kNoise, 4), &flight);
  const Vocabulary vocabulary = VocabularyOf(flight);
  const Outcome run = Fly(flight, &vocabulary);
  EXPECT_GE(run.result.relocalisations, 1);
  ASSERT_EQ(run.maps.size(), 1u);
  EXPECT_EQ(LocatedIn(run, run.maps[0]), flight.size());
  EXPECT_LT(PathError(run, flight, run.maps[0]), 0.02);
}

TEST(SlamPlaces, IsFoundAgainWhereNoLoopIsClosed) {
  const FeatureWorld world = Court(2);
  SyntheticFlight flight = MakeFlight(world, Walk(0, kLap + 60), kNoise, 3);
  Append(MakeFlight(world, Walk(0.4, 20), kNoise, 4), &flight);
  flight.camera.pinhole.fx *= 1.04;  // without drift there is no loop to close
  flight.camera.pinhole.fy *= 1.04;
  const Vocabulary vocabulary = VocabularyOf(flight);
  SystemOptions no_loops;
  no_loops.looping.enabled = false;
  const Outcome with = Fly(flight, &vocabulary);
  const Outcome without = Fly(flight, &vocabulary, Schedule::kSequential, nullptr, no_loops);
  EXPECT_GE(with.result.closed_loops, 1);
  EXPECT_EQ(without.result.closed_loops, 0);
  EXPECT_GE(without.result.relocalisations, 1);
  EXPECT_EQ(without.maps.size(), 1u);
}

TEST(SlamPlaces, LostFramesAreFoundByOptionsOfTheirOwn) {
  const FeatureWorld world = Court(2);
  SyntheticFlight flight = MakeFlight(world, Walk(0, 100), kNoise, 3);
  Append(MakeFlight(world, Walk(0.1, 60), kNoise, 4), &flight);
  const Vocabulary vocabulary = VocabularyOf(flight);
  constexpr int kMoreThanThereAre = 10'000;
  SystemOptions verifying, tracking;
  verifying.looping.relocaliser.min_inliers = kMoreThanThereAre;
  tracking.tracking.relocaliser.min_inliers = kMoreThanThereAre;
  const auto found = [&](const SystemOptions& options) {
    return Fly(flight, &vocabulary, Schedule::kSequential, nullptr, options).result.relocalisations;
  };
  EXPECT_GE(found(verifying), 1);
  EXPECT_EQ(found(tracking), 0);
}

class BlindMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& /*a*/, const Features& /*b*/) override {
    return {};
  }
  std::string Description() const override { return "blind"; }
};

TEST(SlamPlaces, WhatTheQuickMatcherDoesNotFindTheOtherOneDoesForLostFramesAlone) {
  const FeatureWorld world = Court(2);
  SyntheticFlight flight = MakeFlight(world, Walk(0, kLap + 60), kNoise, 3);
  Append(MakeFlight(world, Walk(0.4, 20), kNoise, 4), &flight);
  flight.camera.pinhole.fx *= 1.04;  // without drift there is no loop to close
  flight.camera.pinhole.fy *= 1.04;
  const Vocabulary vocabulary = VocabularyOf(flight);
  BlindMatcher quick;
  const Outcome both = Fly(flight, &vocabulary);
  const Outcome blind = Fly(flight, &vocabulary, Schedule::kSequential, &quick);
  EXPECT_GE(both.result.closed_loops, 1);
  EXPECT_EQ(blind.result.closed_loops, 0);
  EXPECT_GE(blind.result.relocalisations, 1);
}

/// Lost, elsewhere with a new map, and then where the first map is.
SyntheticFlight FlightOfTwoMaps(const FeatureWorld& world) {
  SyntheticFlight flight = MakeFlight(world, Walk(0, 80), kNoise, 3);
  Append(Blind(40), &flight);
  Append(MakeFlight(world, Walk(0.6, 170), kNoise, 4), &flight);
  return flight;
}

TEST(SlamPlaces, JoinsTwoMapsThatMeet) {
  const SyntheticFlight flight = FlightOfTwoMaps(Court(3));
  const Vocabulary vocabulary = VocabularyOf(flight);
  const Outcome run = Fly(flight, &vocabulary);
  EXPECT_EQ(run.result.merged_maps, 1);
  ASSERT_EQ(run.maps.size(), 1u);
  EXPECT_EQ(LocatedIn(run, run.maps[0]), flight.size() - 40);
  EXPECT_LT(PathError(run, flight, run.maps[0]), 0.05);
}

TEST(SlamPlaces, KeepsMapsOfDifferentPlacesApart) {
  SyntheticFlight flight = MakeFlight(Court(4), Walk(0, 90), kNoise, 3);
  Append(MakeFlight(Court(5), Walk(0, 90), kNoise, 4), &flight);
  const Vocabulary vocabulary = VocabularyOf(flight);
  const Outcome run = Fly(flight, &vocabulary);
  EXPECT_EQ(run.result.merged_maps + run.result.closed_loops + run.result.relocalisations, 0);
  EXPECT_EQ(run.maps.size(), 2u);
}

TEST(SlamPlaces, GivesTheSameBytesOnThreads) {
  const SyntheticFlight flight = FlightOfTwoMaps(Court(3));
  const Vocabulary vocabulary = VocabularyOf(flight);
  const Outcome sequential = Fly(flight, &vocabulary);
  for (int run = 0; run < 3; ++run) {
    EXPECT_TRUE(Bytes(Fly(flight, &vocabulary, Schedule::kThreaded).result) ==
                Bytes(sequential.result));
  }
}

/// Gives the upright descriptors for all headings, and counts.
class CountingDescriber : public TurnedDescriber {
 public:
  Descriptors DescribeTurned(const GreyImage&, const Features& features,
                             int quarter_turns) override {
    calls += quarter_turns == 1;
    return features.descriptors;
  }
  int calls = 0;
};

TEST(SlamPlaces, LooksForALostCameraTurnedOnlyNowAndThen) {
  SyntheticFlight flight = MakeFlight(Court(6), Walk(0, 80), kNoise, 3);
  constexpr int kBlind = 31;
  Append(Blind(kBlind), &flight);
  const Vocabulary vocabulary = VocabularyOf(flight);
  PreparedFeatures extractor(flight.features);
  NearestNeighbourMatcher matcher({});
  const auto calls_with_interval = [&](double interval_s) {
    CountingDescriber describer;
    NumberedImages images(flight.size(), flight.frame_interval_s);
    SystemOptions options;
    options.turned_interval_s = interval_s;
    Slam(flight.camera, options, {&extractor, &matcher, &vocabulary, &describer})
        .Run(&images, Schedule::kSequential);
    return describer.calls;
  };
  const int at_keyframes = calls_with_interval(1e6) - 1;  // one at the first lost frame
  EXPECT_EQ(calls_with_interval(0) - at_keyframes, kBlind);
  EXPECT_EQ(calls_with_interval(10 * flight.frame_interval_s - 1e-6) - at_keyframes, 4);
}

}  // namespace
}  // namespace deepuav
