#pragma once

#include <algorithm>
#include <cmath>

namespace deepuav {

inline float SmoothStep(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

inline float Mix(float a, float b, float t) { return a + t * (b - a); }

/// The share of the window of `footprint` around `x` that lies in [low, high].
inline float BandCoverage(float low, float high, float x, float footprint) {
  const float width = std::max(footprint, 1e-4f);
  const float from = std::max(low, x - width / 2), to = std::min(high, x + width / 2);
  return std::max(0.0f, to - from) / width;
}

/// The same for bands of width `band` that begin at every multiple of `period`.
inline float StripeCoverage(float x, float period, float band, float footprint) {
  const float width = std::max(footprint, 1e-4f);
  const auto filled_until = [&](float at) {
    const float whole = std::floor(at / period);
    return whole * band + std::min(at - whole * period, band);
  };
  // Relative to the stripe at hand, for differences of large numbers are coarse.
  const float base = std::floor(x / period) * period;
  return (filled_until(x - base + width / 2) - filled_until(x - base - width / 2)) / width;
}

/// 1 where details of size `detail` can be told apart under the footprint, falling to 0 where not.
inline float DetailVisibility(float detail, float footprint) {
  return 1 - SmoothStep(0.35f * detail, 1.1f * detail, footprint);
}

}  // namespace deepuav
