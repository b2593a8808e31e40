#pragma once

#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include "deepuav/base/time.h"

namespace deepuav {

/// Measures how long after their arrival images get their poses. Thread-safe.
class LatencyMeter {
 public:
  /// An image goes to the run.
  void Arrived(Timestamp time, const Stopwatch& since_arrival);
  /// Its pose is known, or that there is none.
  void Done(Timestamp time);

  struct Latencies {
    double median_s = 0, p95_s = 0, newest_s = 0;
    int64_t count = 0;  ///< Frames that they are of: the latest.
  };
  /// Of the latest `most` frames.
  Latencies Latest(size_t most) const;
  /// Of all that are remembered.
  Latencies All() const { return Latest(kRemembered); }

 private:
  static constexpr size_t kRemembered = 72'000;  // An hour at 20 images a second.
  static constexpr size_t kUnderWay = 64;

  mutable std::mutex mutex_;
  std::deque<std::pair<Timestamp, Stopwatch>> under_way_;
  std::deque<float> latencies_s_;
};

}  // namespace deepuav
