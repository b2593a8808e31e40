// What a run forgets while it goes on.

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/system/testing/slam_runs.h"
#include "support/map_builder.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

/// Along the box and back, again and again.
std::vector<SE3> BackAndForth(int count, int turns) {
  std::vector<SE3> path = WeavingPath(count), all;
  for (int turn = 0; turn < turns; ++turn) {
    all.insert(all.end(), path.begin(), path.end());
    std::reverse(path.begin(), path.end());
  }
  return all;
}

TEST(SlamMemory, WhatNoFrameRefersToAnyMoreIsForgottenAndNothingElseIs) {
  const SyntheticFlight flight = MakeFlight(BoxWorld(), BackAndForth(40, 6), kNoise, 5);
  const auto limited = OptionsWith(&SystemOptions::max_records, 40);
  const Outcome all = Fly(flight), some = Fly(flight, Schedule::kSequential, limited);
  EXPECT_EQ(some.result.failure, "");
  EXPECT_GT(some.result.forgotten_frames, 150);
  for (const FrameRecord& record : some.result.frames) {
    EXPECT_TRUE(record.located() || !record.tracked_online) << record.id.value;
  }
  EXPECT_GT(Located(some.result), 25);
  EXPECT_LT(PathError(some.result, flight), 0.05);

  const Map& remembers = all.slam->atlas().At({0});
  const Map& forgets = some.slam->atlas().At({0});
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(forgets));
  EXPECT_EQ(forgets.KeyframeCount(), remembers.KeyframeCount());
  EXPECT_EQ(forgets.LandmarkCount(), remembers.LandmarkCount());
  EXPECT_LT(forgets.culled().size(), remembers.culled().size());

  const Outcome threaded = Fly(flight, Schedule::kThreaded, limited);
  EXPECT_EQ(Bytes(threaded.result), Bytes(some.result));
  EXPECT_EQ(threaded.slam->atlas().At({0}).culled().size(), forgets.culled().size());
}

}  // namespace
}  // namespace deepuav
