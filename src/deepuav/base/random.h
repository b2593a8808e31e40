#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace deepuav {

/// The one source of randomness: seeded from the options, passed in where it is used. The
/// distributions are written out here because the standard's are free to differ between libraries.
/// Not thread-safe: one per owner.
class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, bound); bound > 0.
  int Index(int bound) {
    return static_cast<int>((engine_() >> 32) * static_cast<uint64_t>(bound) >> 32);
  }
  /// Uniform in [low, high).
  double Uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1.0p-53);
  }
  /// Normal with mean 0 (Marsaglia's polar method).
  double Gaussian(double sigma) {
    double u, v, s;
    do {
      u = Uniform(-1, 1);
      v = Uniform(-1, 1);
      s = u * u + v * v;
    } while (s >= 1 || s == 0);
    return sigma * u * std::sqrt(-2 * std::log(s) / s);
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace deepuav
