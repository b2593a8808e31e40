#pragma once

#include <utility>
#include <vector>

#include "deepuav/base/median.h"
#include "deepuav/base/time.h"

namespace deepuav {

/// An interval of a series longer than this many of its median ones is a gap.
inline constexpr double kLongestInMedianIntervals = 3;

/// Of things by growing `time`; 0 of fewer than two. An even number has the larger of both.
template <typename Timed>
double MedianInterval_s(const std::vector<Timed>& series) {
  if (series.size() < 2) return 0;
  std::vector<double> intervals_s;
  intervals_s.reserve(series.size() - 1);
  for (size_t i = 1; i < series.size(); ++i)
    intervals_s.push_back(SecondsBetween(series[i - 1].time, series[i].time));
  return Median(std::move(intervals_s));
}

}  // namespace deepuav
