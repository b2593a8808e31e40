#include "deepuav/capture/stream_clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr int64_t kLeastStep = 1'000'000;  // Nanoseconds between images.

}  // namespace

ArrivalClock::ArrivalClock()
    : start_{std::chrono::duration_cast<std::chrono::nanoseconds>(
                 std::chrono::system_clock::now().time_since_epoch())
                 .count()} {}

Timestamp ArrivalClock::Now() const {
  return {start_.nanoseconds + std::llround(1e9 * since_start_.Seconds())};
}

Timestamp StreamClock::TimeOf(std::optional<Timestamp> stream, Timestamp arrival,
                              std::string* jump) {
  jump->clear();
  const bool by_stream = options_.clock == ImageClock::kStream && stream.has_value();
  Timestamp time = by_stream ? Timestamp{stream->nanoseconds + offset_ns_} : arrival;
  if (last_) {
    const Timestamp least{last_->time.nanoseconds + kLeastStep};
    const Timestamp expected{last_->time.nanoseconds + arrival.nanoseconds -
                             last_->arrival.nanoseconds};
    const double off_s = SecondsBetween(expected, time);
    const bool jumped = time <= last_->time || std::abs(off_s) > options_.max_jump_s;
    if (by_stream && (jumped || is_reopened_)) {
      if (!is_reopened_)
        *jump = fmt::format("the stream's clock jumped by {:+.3f} s: times go on by the arrival's",
                            off_s);
      offset_ns_ += std::max(expected, least).nanoseconds - time.nanoseconds;
      time = std::max(expected, least);
    }
    time = std::max(time, least);
  }
  is_reopened_ = false;
  last_ = Image{time, arrival};
  return time;
}

}  // namespace deepuav
