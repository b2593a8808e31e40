#include "deepuav/system/watching/stage_clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

namespace deepuav {
namespace {

TEST(StageClock, MeasuresEachTimeAStageRan) {
  StageClock clock;
  for (int i = 0; i < 3; ++i) {
    const StageScope outer(&clock, "outer");
    const StageScope inner(&clock, "inner");
    const Stopwatch busy;
    while (busy.Seconds() < 0.002) {
    }
  }
  clock.Add("elsewhere", 1.5);
  const auto durations = clock.Durations();
  ASSERT_EQ(durations.size(), 3u);
  EXPECT_EQ(durations.at("elsewhere"), std::vector<double>{1.5});
  ASSERT_EQ(durations.at("outer").size(), 3u);
  ASSERT_EQ(durations.at("inner").size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_GE(durations.at("inner")[i], 0.002);
    EXPECT_GE(durations.at("outer")[i], durations.at("inner")[i]);
  }
}

TEST(StageClock, RemembersTheLatestAndTellsOfAll) {
  StageClock clock;
  int told = 0;
  clock.RememberLatest(10);
  clock.Tell([&told](const std::string& stage, double /*seconds*/) { told += stage == "stage"; });
  constexpr int kCalls = 1000;
  for (int i = 0; i < kCalls; ++i) clock.Add("stage", i);
  const std::vector<double> durations = clock.Durations().at("stage");
  EXPECT_GE(durations.size(), 10u);
  EXPECT_LE(durations.size(), 20u);
  EXPECT_EQ(durations.back(), kCalls - 1);
  EXPECT_TRUE(std::is_sorted(durations.begin(), durations.end()));
  EXPECT_EQ(told, kCalls);
}

TEST(StageClock, AnEndWithoutBeginIsNothing) {
  StageClock clock;
  clock.End("never begun");
  clock.Begin("never ended");
  EXPECT_TRUE(clock.Durations().empty());
}

TEST(StageClock, KeepsTheStagesOfThreadsApart) {
  StageClock clock;
  std::atomic<bool> long_one_runs = false;
  std::thread other([&] {
    const StageScope stage(&clock, "same name");
    long_one_runs = true;
    const Stopwatch busy;
    while (busy.Seconds() < 0.05) std::this_thread::yield();
  });
  while (!long_one_runs) std::this_thread::yield();
  for (int i = 0; i < 100; ++i) const StageScope stage(&clock, "same name");
  other.join();
  const auto durations = clock.Durations().at("same name");
  ASSERT_EQ(durations.size(), 101u);
  EXPECT_GE(*std::max_element(durations.begin(), durations.end()), 0.05);
}

}  // namespace
}  // namespace deepuav
