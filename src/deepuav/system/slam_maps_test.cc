// Runs that go on with maps of earlier ones, and what is adjusted beside and behind a run.

#include <gtest/gtest.h>

#include "deepuav/map/map_renumbering.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"
#include "support/path_error.h"
#include "support/synthetic_court.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.2, 0, 20};

struct Outcome {
  std::unique_ptr<Slam> slam;
  SlamResult result;
};

Outcome Fly(const SyntheticFlight& flight, const Vocabulary* vocabulary,
            const SystemOptions& options = {}, Schedule schedule = Schedule::kSequential,
            const Atlas* loaded = nullptr) {
  PreparedFeatures extractor(flight.features);
  NearestNeighbourMatcher matcher({});
  NumberedImages images(flight.size(), flight.frame_interval_s);
  Outcome run;
  run.slam = std::make_unique<Slam>(flight.camera, options,
                                    Perception{&extractor, &matcher, vocabulary, nullptr});
  if (loaded) {
    Atlas copy;
    TakeMaps(*loaded, &copy);
    run.slam->Load(std::move(copy));
  }
  run.result = run.slam->Run(&images, schedule);
  EXPECT_EQ(run.result.failure, "");
  return run;
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

class LoadedMapTest : public testing::Test {
 protected:
  LoadedMapTest()
      : first_flight_(MakeFlight(world_, Walk(0, 100), kNoise, 3)),
        second_flight_(MakeFlight(world_, Walk(0.08, 50), kNoise, 4)),
        vocabulary_(VocabularyOf(first_flight_)),
        first_(Fly(first_flight_, &vocabulary_)) {}

  /// Both flights' poses, as they lie in the one map.
  double CommonError(const SlamResult& second) const {
    std::vector<Eigen::Vector3d> estimate, truth;
    const auto add = [&](const SlamResult& result, const SyntheticFlight& flight) {
      for (const FrameRecord& record : result.frames) {
        estimate.push_back(record.cam_from_world.InverseTranslation());
        truth.push_back(
            flight.cam_from_world[static_cast<size_t>(record.id.value)].InverseTranslation());
      }
    };
    add(first_.result, first_flight_);
    add(second, second_flight_);
    return RmseAfterAlignment(estimate, truth);
  }

  const FeatureWorld world_ = Court(2);
  SyntheticFlight first_flight_, second_flight_;
  const Vocabulary vocabulary_;
  const Outcome first_;
};

TEST_F(LoadedMapTest, IsFoundAndExtended) {
  const Map& before = first_.slam->atlas().At(MapId{0});
  SystemOptions options;
  options.adjust_at_end = false;  // The frame of the map stays that of the first run.
  const Outcome second =
      Fly(second_flight_, &vocabulary_, options, Schedule::kThreaded, &first_.slam->atlas());
  EXPECT_EQ(second.result.relocalisations, 1);
  ASSERT_EQ(second.slam->atlas().Remaining(), std::vector<MapId>{{0}});
  for (const FrameRecord& record : second.result.frames)
    ASSERT_EQ(record.map, MapId{0}) << record.id.value;
  EXPECT_TRUE(second.result.frames.front().tracked_online);
  EXPECT_LT(CommonError(second.result), 0.03);
  const Map& after = second.slam->atlas().At(MapId{0});
  int newer = 0;
  after.keyframes().ForEach(
      [&](const Keyframe& keyframe) { newer += !before.Contains(keyframe.id); });
  EXPECT_GT(newer, 0);
}

TEST_F(LoadedMapTest, StaysAsItIsWhereOnlyLocalised) {
  SystemOptions options;
  options.localise_only = true;
  const Map& before = first_.slam->atlas().At(MapId{0});
  const Outcome second =
      Fly(second_flight_, &vocabulary_, options, Schedule::kSequential, &first_.slam->atlas());
  const Map& after = second.slam->atlas().At(MapId{0});
  EXPECT_EQ(after.KeyframeCount(), before.KeyframeCount());
  EXPECT_EQ(after.LandmarkCount(), before.LandmarkCount());
  before.keyframes().ForEach([&after](const Keyframe& keyframe) {
    EXPECT_EQ(after.At(keyframe.id).cam_from_world.Matrix(), keyframe.cam_from_world.Matrix());
  });
  for (const FrameRecord& record : second.result.frames)
    ASSERT_EQ(record.map, MapId{0}) << record.id.value;
  EXPECT_LT(CommonError(second.result), 0.03);
}

TEST_F(LoadedMapTest, IsLeftAloneByAFlightElsewhere) {
  const SyntheticFlight elsewhere = MakeFlight(Court(9), Walk(0, 50), kNoise, 4);
  const Outcome second =
      Fly(elsewhere, &vocabulary_, {}, Schedule::kSequential, &first_.slam->atlas());
  EXPECT_EQ(second.result.relocalisations, 0);
  EXPECT_EQ(second.slam->atlas().Remaining(), (std::vector<MapId>{{0}, {1}}));
  for (const FrameRecord& record : second.result.frames) EXPECT_NE(record.map, MapId{0});
}

TEST(SlamAdjustment, EntersSoManyKeyframesAfterALoopInAnyThread) {
  SyntheticFlight flight = MakeFlight(Court(1), Walk(0, kLap + 60), kNoise, 3);
  flight.camera.pinhole.fx *= 1.04;
  flight.camera.pinhole.fy *= 1.04;
  const Vocabulary vocabulary = VocabularyOf(flight);
  SystemOptions options;
  options.adjust_at_end = false;
  options.adjustment_delay_keyframes = 2;
  const Outcome soon = Fly(flight, &vocabulary, options);
  ASSERT_GE(soon.result.closed_loops, 1);
  EXPECT_EQ(soon.result.stage_durations_s.at("global bundle adjustment").size(),
            static_cast<size_t>(soon.result.closed_loops));
  for (int run = 0; run < 2; ++run) {
    const Outcome threaded = Fly(flight, &vocabulary, options, Schedule::kThreaded);
    EXPECT_TRUE(Bytes(threaded.result) == Bytes(soon.result));
  }
  options.adjustment_delay_keyframes = 1'000'000;
  const Outcome never = Fly(flight, &vocabulary, options);
  EXPECT_EQ(never.result.closed_loops, soon.result.closed_loops);
  EXPECT_FALSE(Bytes(never.result) == Bytes(soon.result)) << "it did enter";
}

TEST(SlamFocalLength, IsFoundAtTheEndWhereItWasAGuess) {
  const FeatureWorld world = Court(3);
  for (const double factor : {0.96, 1.05}) {
    SyntheticFlight flight = MakeFlight(world, Walk(0, 150), kNoise, 5);
    const double truth = flight.camera.pinhole.fx;
    flight.camera.pinhole.fx = flight.camera.pinhole.fy = factor * truth;
    const Outcome as_given = Fly(flight, nullptr);
    EXPECT_EQ(as_given.slam->camera().pinhole.fx, factor * truth);
    SystemOptions options;
    options.refine_focal = true;
    const Outcome refined = Fly(flight, nullptr, options);
    EXPECT_NEAR(refined.slam->camera().pinhole.fx / truth, 1, 0.01);
    EXPECT_EQ(refined.slam->camera().pinhole.fx, refined.slam->camera().pinhole.fy);
  }
}

TEST(SlamFocalLength, IsNotTouchedWhereTheLensDistorts) {
  SyntheticFlight flight = MakeFlight(Court(3), Walk(0, 40), kNoise, 5);
  flight.camera.lens = LensModel::kRadialTangential;
  flight.camera.distortion = {0, 0, 0, 0};
  SystemOptions options;
  options.refine_focal = true;
  const Outcome run = Fly(flight, nullptr, options);
  EXPECT_EQ(run.slam->camera().pinhole.fx, flight.camera.pinhole.fx);
}

}  // namespace
}  // namespace deepuav
