#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>

namespace deepuav {

/// Follows an offset between two clocks that is measured again and again, so slowly that what one
/// of them says passed, passed on the other, too: an integrated motion bears no jerks of time.
/// Thread-compatible; nanoseconds.
class GentleOffset {
 public:
  /// The offset to be used at `time_ns`, which grows. It is `measured_ns` at once where that is
  /// the first, or so far away that it is another clock's.
  int64_t Towards(int64_t measured_ns, int64_t time_ns) {
    constexpr double kMostSlew = 1e-3;  // Seconds a second; clocks' crystals differ by 1e-4.
    constexpr int64_t kOtherClock_ns = 50'000'000;
    const int64_t step_ns = measured_ns - offset_ns_.value_or(measured_ns);
    if (!offset_ns_ || std::abs(step_ns) > kOtherClock_ns) {
      offset_ns_ = measured_ns;
    } else {
      const int64_t most_ns =
          std::llround(kMostSlew * static_cast<double>(std::max(time_ns - time_ns_, int64_t{0})));
      *offset_ns_ += std::clamp(step_ns, -most_ns, most_ns);
    }
    time_ns_ = time_ns;
    return *offset_ns_;
  }

 private:
  std::optional<int64_t> offset_ns_;
  int64_t time_ns_ = 0;
};

}  // namespace deepuav
