#pragma once

#include <deque>
#include <optional>

#include "deepuav/base/time.h"

namespace deepuav {

/// Nanoseconds of the machine's clock that never jumps.
int64_t SteadyNow();

/// What images' times are on the machine's clock: those that came fastest of the latest say it, as
/// delays only ever add. Thread-compatible.
class SteadyImageClock {
 public:
  /// `latest`: images; `jump_s`: between an image and the one before, from which on it is another
  /// clock.
  explicit SteadyImageClock(size_t latest = 60, double jump_s = 1)
      : latest_(latest), jump_s_(jump_s) {}

  void Arrived(Timestamp time, int64_t arrival_ns);
  /// Nothing before the first image.
  std::optional<int64_t> SteadyOf(Timestamp time) const;
  /// What is to be added to an image's time; nothing before the first.
  std::optional<int64_t> offset_ns() const;

 private:
  const size_t latest_;
  const double jump_s_;
  std::deque<int64_t> offsets_ns_;  ///< Of the latest images, from their times to their arrival's.
};

}  // namespace deepuav
