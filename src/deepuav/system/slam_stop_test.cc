// Runs that end early, fail or come live, and what they keep.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "deepuav/base/error.h"
#include "deepuav/base/time.h"
#include "deepuav/system/testing/slam_runs.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

TEST(Slam, KeepsTheResultUntilTheSourceFailed) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(60), kNoise, 5);
  for (const Schedule schedule : {Schedule::kSequential, Schedule::kThreaded}) {
    const Outcome run = Fly(flight, schedule, {}, nullptr, nullptr, 45);
    EXPECT_EQ(run.result.failure, "the disk is gone");
    ASSERT_EQ(run.result.frames.size(), 45u);
    EXPECT_EQ(Located(run.result), 45);
    EXPECT_LT(PathError(run.result, flight), 0.05);
  }
  const Outcome nothing = Fly(flight, Schedule::kThreaded, {}, nullptr, nullptr, 0);
  EXPECT_EQ(nothing.result.failure, "the disk is gone");
  EXPECT_TRUE(nothing.result.frames.empty());
}

TEST(Slam, OfNoImagesIsAnEmptyResult) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), {}, kNoise, 5);
  for (const Schedule schedule : {Schedule::kSequential, Schedule::kThreaded, Schedule::kLive}) {
    const Outcome run = Fly(flight, schedule);
    EXPECT_EQ(run.result.failure, "");
    EXPECT_TRUE(run.result.frames.empty());
  }
}

TEST(Slam, StopsWhenAskedAndTellsItsProgress) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(60), kNoise, 6);
  for (const Schedule schedule : {Schedule::kSequential, Schedule::kThreaded}) {
    int64_t told = 0;
    const Outcome run = Fly(
        flight, schedule, {},
        [&told](const FrameRecord& record) { EXPECT_EQ(record.id.value, told++); },
        [&told] { return told == 40; });
    EXPECT_TRUE(run.result.stopped);
    EXPECT_EQ(run.result.frames.size(), 40u);
    EXPECT_EQ(told, 40);
    EXPECT_EQ(Located(run.result), 40);
  }
}

TEST(Slam, FinishesAStoppedRunInTheTimeThatItHas) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(60), kNoise, 6);
  const auto located_within = [&flight](double finish_stopped_s) {
    SystemOptions options;
    options.finish_stopped_s = finish_stopped_s;
    int64_t told = 0;
    const Outcome run = Fly(
        flight, Schedule::kSequential, options, [&told](const FrameRecord&) { ++told; },
        [&told] { return told == 40; });
    EXPECT_EQ(run.result.failure, "");
    return Located(run.result);
  };
  EXPECT_EQ(located_within(1000), 40);
  const int online = located_within(0);
  EXPECT_LT(online, 40) << "those before the map began";
  EXPECT_GT(online, 20);
}

TEST(Slam, CanBeStoppedWhileItFinishes) {
  constexpr int kFrames = 40;
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(kFrames), kNoise, 6);
  SystemOptions options;
  options.finish_stopped_s = 0;
  int64_t told = 0;
  int asked_at_the_end = 0;
  const Outcome run = Fly(
      flight, Schedule::kSequential, options, [&told](const FrameRecord&) { ++told; },
      [&] { return told == kFrames && ++asked_at_the_end > 1; });  // once more by the frames' loop
  EXPECT_EQ(run.result.failure, "");
  EXPECT_EQ(run.result.frames.size(), static_cast<size_t>(kFrames));
  EXPECT_TRUE(run.result.stopped);
  EXPECT_LT(Located(run.result), kFrames) << "those before the map began";
}

TEST(Slam, LiveSkipsAndCountsWhatComesTooFast) {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(100), kNoise, 7);
  flight.frame_interval_s = 0.001;
  std::set<int64_t> given;
  const Outcome run = Fly(flight, Schedule::kLive, {}, [&given](const FrameRecord& record) {
    given.insert(record.id.value);
    const Stopwatch busy;
    while (busy.Seconds() < 0.01) {
    }
  });
  EXPECT_EQ(run.result.failure, "");
  EXPECT_GT(run.result.skipped_late, 10);
  EXPECT_EQ(given.size() + static_cast<size_t>(run.result.skipped_late), 100u);
  EXPECT_EQ(run.result.frames.size(), given.size());
}

TEST(Slam, AFailedLiveRunDoesNotWaitForTheNextImage) {
  SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(3), kNoise, 7);
  flight.frame_interval_s = 60;
  const Stopwatch watch;
  const Outcome run = Fly(flight, Schedule::kLive, {},
                          [](const FrameRecord&) { throw Error("no room on the screen"); });
  EXPECT_EQ(run.result.failure, "no room on the screen");
  EXPECT_LT(watch.Seconds(), 30);
}

TEST(Slam, ForgetsTheFeaturesOfFramesThatCannotBeLocatedAnyMore) {
  std::vector<SE3> path(30, SE3());  // hovers: no map
  const auto options = OptionsWith(&SystemOptions::max_unlocated_frames, 10);
  const Outcome run = Fly(MakeFlight(BoxWorld(), path, kNoise, 14), Schedule::kSequential, options);
  int kept = 0;
  for (const FrameRecord& record : run.result.frames) kept += record.features != nullptr;
  EXPECT_EQ(kept, 10);
}

TEST(Slam, KeepsLittleOfFramesLongPast) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), WeavingPath(80), kNoise, 3);
  SystemOptions options;
  options.full_record_frames = 10;
  options.old_record_landmarks = 40;
  options.young_map_frames = 0;  // Those see all anew at the end.
  const Outcome run = Fly(flight, Schedule::kSequential, options);
  ASSERT_EQ(run.result.frames.size(), 80u);
  EXPECT_EQ(Located(run.result), 80);
  EXPECT_LT(PathError(run.result, flight), 0.05);
  for (size_t i = 20; i < 80; ++i) {
    const FrameRecord& record = run.result.frames[i];
    EXPECT_GT(record.landmark_count, 40);
    EXPECT_EQ(record.seen.size(), i < 70 ? 40u : static_cast<size_t>(record.landmark_count)) << i;
  }
}

}  // namespace
}  // namespace deepuav
