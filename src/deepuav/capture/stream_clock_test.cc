#include "deepuav/capture/stream_clock.h"

#include <gmock/gmock.h>

#include <limits>

namespace deepuav {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kHour = 3'600'000 * kMs;
constexpr int64_t kStart = 1'000'000 * kMs;

Timestamp Ms(int64_t ms) { return {ms * kMs}; }

struct Clock {
  explicit Clock(ImageClock kind) : clock({kind, 10}) {}
  Timestamp At(std::optional<Timestamp> stream, Timestamp arrival) {
    return clock.TimeOf(stream, arrival, &jump);
  }
  StreamClock clock;
  std::string jump;
};

TEST(StreamClock, GivesTheTimeOfArrivalOrOfTheStream) {
  Clock arrival(ImageClock::kArrival), stream(ImageClock::kStream);
  EXPECT_EQ(arrival.At(Ms(7), Ms(1000)), Ms(1000));
  EXPECT_EQ(stream.At(Ms(7), Ms(1000)), Ms(7));
  EXPECT_EQ(stream.At(Ms(47), Ms(1080)), Ms(47));
  EXPECT_EQ(stream.jump, "");
}

TEST(StreamClock, WithoutAClockOfTheStreamArrivalCounts) {
  Clock stream(ImageClock::kStream);
  EXPECT_EQ(stream.At(std::nullopt, Ms(1000)), Ms(1000));
}

TEST(StreamClock, GoesOnWhereTheStreamJumpsByAnHour) {
  for (const int64_t hour : {-kHour, kHour}) {
    Clock stream(ImageClock::kStream);
    stream.At(Timestamp{kStart + kHour}, Ms(0));
    EXPECT_EQ(stream.At(Timestamp{kStart + kHour + hour + 50 * kMs}, Ms(50)),
              (Timestamp{kStart + kHour + 50 * kMs}));
    EXPECT_THAT(stream.jump, testing::HasSubstr("3600.000 s"));
    // From there on by the stream's clock again.
    EXPECT_EQ(stream.At(Timestamp{kStart + kHour + hour + 83 * kMs}, Ms(100)),
              (Timestamp{kStart + kHour + 83 * kMs}));
    EXPECT_EQ(stream.jump, "");
  }
}

TEST(StreamClock, TimesGrowWhateverComes) {
  for (const ImageClock clock : {ImageClock::kArrival, ImageClock::kStream}) {
    Clock one(clock);
    Timestamp last{std::numeric_limits<int64_t>::min()};
    for (const int64_t ms : {100, 100, 90, 140, 141, 0}) {
      const Timestamp time = one.At(Ms(ms), Ms(100));  // All at once.
      EXPECT_GT(time, last);
      last = time;
    }
  }
}

TEST(StreamClock, AfterReopeningTheStreamMayBeginAnewWithoutAWord) {
  Clock stream(ImageClock::kStream);
  stream.At(Ms(5000), Ms(0));
  stream.clock.Reopened();
  EXPECT_EQ(stream.At(Ms(0), Ms(2000)), Ms(7000));
  EXPECT_EQ(stream.jump, "");
  EXPECT_EQ(stream.At(Ms(40), Ms(2050)), Ms(7040));
}

TEST(ArrivalClock, NeverGoesBack) {
  const ArrivalClock clock;
  const Timestamp before = clock.Now();
  EXPECT_GT(before.seconds(), 1e9);
  EXPECT_GE(clock.Now(), before);
}

}  // namespace
}  // namespace deepuav
