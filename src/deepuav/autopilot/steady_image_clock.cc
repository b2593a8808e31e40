#include "deepuav/autopilot/steady_image_clock.h"

#include <algorithm>
#include <cstdlib>

namespace deepuav {

int64_t SteadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void SteadyImageClock::Arrived(Timestamp time, int64_t arrival_ns) {
  const int64_t offset_ns = arrival_ns - time.nanoseconds;
  const auto is_other_clock = [&](int64_t before_ns) {
    return 1e-9 * static_cast<double>(std::abs(offset_ns - before_ns)) > jump_s_;
  };
  if (!offsets_ns_.empty() && is_other_clock(offsets_ns_.back())) offsets_ns_.clear();
  offsets_ns_.push_back(offset_ns);
  if (offsets_ns_.size() > latest_) offsets_ns_.pop_front();
}

std::optional<int64_t> SteadyImageClock::SteadyOf(Timestamp time) const {
  const std::optional<int64_t> offset = offset_ns();
  if (!offset) return std::nullopt;
  return time.nanoseconds + *offset;
}

std::optional<int64_t> SteadyImageClock::offset_ns() const {
  if (offsets_ns_.empty()) return std::nullopt;
  return *std::min_element(offsets_ns_.begin(), offsets_ns_.end());
}

}  // namespace deepuav
