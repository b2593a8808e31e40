#pragma once

#include <chrono>
#include <compare>
#include <cstdint>

namespace deepuav {

/// An instant of the dataset's clock.
struct Timestamp {
  int64_t nanoseconds = 0;

  auto operator<=>(const Timestamp&) const = default;
  double seconds() const { return 1e-9 * static_cast<double>(nanoseconds); }
};

/// Seconds from `from` to `to`; exact subtraction before the conversion to floating point.
inline double SecondsBetween(Timestamp from, Timestamp to) {
  return 1e-9 * static_cast<double>(to.nanoseconds - from.nanoseconds);
}

/// Wall-clock seconds since construction or the last Restart().
class Stopwatch {
 public:
  double Seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  void Restart() { start_ = Clock::now(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace deepuav
