#pragma once

#include <cmath>

#include "deepuav/base/time.h"

namespace deepuav {

/// `start` and `seconds` later, to the nearest nanosecond.
inline Timestamp After(Timestamp start, double seconds) {
  constexpr double kNanoseconds = 1e9;
  return {start.nanoseconds + std::llround(seconds * kNanoseconds)};
}

/// Samples from time 0 to `duration_s` at a rate, both ends included.
inline int SampleCount(double duration_s, double rate_hz) {
  constexpr double kRounding = 1e-6;
  return 1 + static_cast<int>(std::floor(duration_s * rate_hz + kRounding));
}

}  // namespace deepuav
