#include "deepuav/capture/live_feed.h"

#include <gmock/gmock.h>

#include <deque>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;

GreyImage Picture(int seed, int width = kWidth, int height = kHeight) {
  GreyImage image(height, width);
  cv::RNG random(static_cast<uint64_t>(seed) + 1);
  random.fill(image, cv::RNG::UNIFORM, 0, 255);
  return image;
}

/// Gives what it is told; nullopt stands for a link that drops. Then it ends for good.
class Script : public LiveSource {
 public:
  explicit Script(std::deque<std::optional<LiveImage>> steps) : steps_(std::move(steps)) {}
  void Open() override {
    ++opened;
    if (refusals > 0 && opened > 1) {
      --refusals;
      throw Error("script: no");
    }
    if (never) throw Error("script: never");
  }
  std::optional<LiveImage> Next(const std::function<bool()>& /*stop*/) override {
    if (steps_.empty()) return std::nullopt;
    auto step = std::move(steps_.front());
    steps_.pop_front();
    return step;
  }
  bool EndsForGood() const override { return steps_.empty(); }
  std::string Name() const override { return "script"; }
  int64_t late() const override { return left_out; }

  int64_t left_out = 0;
  int opened = 0, refusals = 0;
  bool never = false;

 private:
  std::deque<std::optional<LiveImage>> steps_;
};

struct Outcome {
  std::vector<GreyImage> images;
  std::vector<Timestamp> times;
  std::vector<std::string> lines;
  LiveCounts counts;
};

Outcome Play(Script* script, LiveFeedOptions options = {}) {
  Outcome outcome;
  options.first_wait_s = options.longest_wait_s = 0.001;
  LiveFeed feed(script, {kWidth, kHeight}, options,
                {[&](GreyImage image, Timestamp time, const Stopwatch&) {
                   outcome.images.push_back(image);
                   outcome.times.push_back(time);
                 },
                 [&](const std::string& line) { outcome.lines.push_back(line); }});
  feed.Run([] { return false; });
  outcome.counts = feed.counts();
  return outcome;
}

LiveImage At(int seed, int64_t ms) { return {Picture(seed), Timestamp{ms * 1'000'000}}; }

TEST(LiveFeed, HandsOnWhatComes) {
  Script script({At(1, 0), At(2, 50), At(3, 100)});
  const Outcome outcome = Play(&script, {{ImageClock::kStream, 10}, {}});
  EXPECT_THAT(outcome.times,
              ElementsAre(Timestamp{0}, Timestamp{50'000'000}, Timestamp{100'000'000}));
  EXPECT_THAT(outcome.lines, ElementsAre());
  EXPECT_EQ(outcome.counts.arrived, 3);
  EXPECT_FALSE(outcome.counts.is_open);
}

TEST(LiveFeed, CountsWhatTheSourceLeftOut) {
  Script script({At(1, 0), At(2, 200)});
  script.left_out = 3;
  const LiveCounts counts = Play(&script).counts;
  EXPECT_EQ(counts.arrived, 2);
  EXPECT_EQ(counts.late, 3);
}

TEST(LiveFeed, OpensADroppedLinkAgain) {
  Script script({At(1, 0), std::nullopt, At(2, 0), std::nullopt, At(3, 0)});
  script.refusals = 3;
  const Outcome outcome = Play(&script);
  EXPECT_EQ(outcome.images.size(), 3u);
  EXPECT_EQ(script.opened, 6);
  EXPECT_EQ(outcome.counts.reconnects, 2);
  EXPECT_THAT(outcome.lines, ElementsAre(HasSubstr("dropped"), HasSubstr("open again"),
                                         HasSubstr("dropped"), HasSubstr("open again")));
}

TEST(LiveFeed, FailsWhereItCannotBeOpenedAtFirst) {
  Script script({At(1, 0)});
  script.never = true;
  EXPECT_THROW(Play(&script), Error);
}

TEST(LiveFeed, SaysThatTheClockJumped) {
  Script script({At(1, 3'600'000), At(2, 3'600'050), At(3, 100)});
  const Outcome outcome = Play(&script, {{ImageClock::kStream, 10}, {}});
  ASSERT_EQ(outcome.times.size(), 3u);
  EXPECT_LT(outcome.times[1], outcome.times[2]);
  EXPECT_THAT(outcome.lines, ElementsAre(HasSubstr("jumped by -3")));
}

TEST(LiveFeed, ScalesOtherSizesAndLeavesOutOtherProportions) {
  Script script({At(1, 0), LiveImage{Picture(2, 2 * kWidth, 2 * kHeight), {}},
                 LiveImage{Picture(3, 2 * kWidth, kHeight), {}},
                 LiveImage{Picture(4, 2 * kWidth, kHeight), {}}, At(5, 1)});
  const Outcome outcome = Play(&script);
  ASSERT_EQ(outcome.images.size(), 3u);
  for (const GreyImage& image : outcome.images) EXPECT_EQ(image.size(), cv::Size(kWidth, kHeight));
  EXPECT_EQ(outcome.counts.misfits, 2);
  EXPECT_THAT(outcome.lines, ElementsAre(HasSubstr("128x96 now: scaled to 64x48"),
                                         HasSubstr("128x48 now: left out"),
                                         HasSubstr("64x48 now: as calibrated")));
}

TEST(LiveFeed, LeavesOutAFrozenPicture) {
  Script script({At(1, 0), At(1, 1), At(1, 2), At(2, 3)});
  const Outcome outcome = Play(&script, {{}, {.frozen_after_s = 0}});
  // Without patience the first one counts as frozen, too.
  EXPECT_EQ(outcome.counts.frozen, 4);
  EXPECT_THAT(outcome.lines, ElementsAre(HasSubstr("frozen")));
}

TEST(PictureJudge, TellsFrozenFromStandingFromMoving) {
  PictureJudge judge({.frozen_after_s = 1, .standing_after_s = 2});
  const auto at = [](double seconds) { return Timestamp{static_cast<int64_t>(1e9 * seconds)}; };
  EXPECT_EQ(judge.Judge(Picture(1), at(0)), PictureState::kMoving);
  EXPECT_EQ(judge.Judge(Picture(1), at(0.9)), PictureState::kMoving);
  EXPECT_EQ(judge.Judge(Picture(1), at(1.1)), PictureState::kFrozen);
  GreyImage noisy = Picture(1).clone();
  noisy(0, 0) = static_cast<uchar>(noisy(0, 0) ^ 1);
  EXPECT_EQ(judge.Judge(noisy, at(1.2)), PictureState::kMoving);
  EXPECT_EQ(judge.Judge(Picture(1), at(2.1)), PictureState::kStanding);
  EXPECT_EQ(judge.Judge(255 - Picture(1), at(2.2)), PictureState::kMoving);
}

}  // namespace
}  // namespace deepuav
