#include "work/progress_bar.h"

#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>

#include <algorithm>
#include <sstream>
#include <thread>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

using testing::MatchesRegex;

/// Without a terminal, as stderr is captured.
class ProgressBarTest : public testing::Test {
 protected:
  void SetUp() override {
    testing::internal::CaptureStderr();
    before_ = Log().sinks();
    level_ = Log().level();
    Log().sinks() = {std::make_shared<spdlog::sinks::ostream_sink_mt>(log_)};
    Log().set_pattern("%v");
    Log().set_level(spdlog::level::info);
  }
  void TearDown() override {
    Log().sinks() = before_;
    Log().set_level(level_);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  }

  std::vector<std::string> Lines() const {
    std::vector<std::string> lines;
    std::istringstream text(log_.str());
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }

  /// Counts to the end in about that time.
  static double Work(ProgressBar* bar, int total) {
    const Stopwatch working;
    for (int i = 1; i <= total; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      bar->Advance(i, "working");
    }
    return working.Seconds();
  }

  std::ostringstream log_;
  std::vector<spdlog::sink_ptr> before_;
  spdlog::level::level_enum level_{};
};

TEST_F(ProgressBarTest, WithoutATerminalALineOfTheLogTellsOfEveryPause) {
  constexpr double kPause_s = 0.05;
  constexpr int kTotal = 100;
  ProgressBar bar(kTotal, "images", {.redraw_s = 0, .log_s = kPause_s});
  const double worked_s = Work(&bar, kTotal);
  const std::vector<std::string> lines = Lines();
  EXPECT_GE(lines.size(), 1u);
  EXPECT_LE(lines.size(), 1 + static_cast<size_t>(worked_s / kPause_s));
  for (const std::string& line : lines) {
    EXPECT_THAT(line, MatchesRegex("[0-9]+ of 100 images, [0-9]+\\.[0-9] images/s"));
  }
}

TEST_F(ProgressBarTest, AShortTaskTellsNothing) {
  constexpr int kTotal = 5;
  ProgressBar bar(kTotal);
  Work(&bar, kTotal);
  EXPECT_TRUE(Lines().empty());
  EXPECT_EQ(ProgressPauses().log_s, 15);  // as docs/running.md says
}

TEST_F(ProgressBarTest, WhatIsCountedNextBeginsAnew) {
  ProgressBar bar(7, "frames", {.redraw_s = 0, .log_s = 0});
  bar.Advance(7, "");
  bar.Count("pairs", 1, 30);
  const std::vector<std::string> lines = Lines();
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[0], MatchesRegex("7 of 7 frames, .*"));
  EXPECT_THAT(lines[1], MatchesRegex("1 of 30 pairs, .*"));
}

}  // namespace
}  // namespace deepuav
