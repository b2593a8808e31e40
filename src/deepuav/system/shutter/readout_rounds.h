#pragma once

#include <algorithm>

namespace deepuav {

/// What contradicts the readout that a map was made with was taken for outliers meanwhile, and
/// bends its path: so each round of finding it finds but a part of what is left, and what all
/// rounds to come would find is the sum of a geometric series (Aitken's process).
inline double SumOfRounds(double last_s, double now_s) {
  constexpr double kMaxRatio = 0.75;
  const double ratio = last_s != 0 ? std::clamp(now_s / last_s, 0.0, kMaxRatio) : 0;
  return now_s / (1 - ratio);
}

}  // namespace deepuav
