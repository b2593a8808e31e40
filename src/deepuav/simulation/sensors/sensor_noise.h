#pragma once

#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {

/// Noise of standard deviation `sigma` whose correlation falls as exp(-t / correlation_s): a
/// first-order Gauss-Markov process.
class GaussMarkov {
 public:
  GaussMarkov(double sigma, double correlation_s, Random* random)
      : sigma_(sigma), correlation_s_(correlation_s), value_(random->Gaussian(sigma)) {}

  double value() const { return value_; }
  void Advance(double step_s, Random* random) {
    const double kept = std::exp(-step_s / correlation_s_);
    value_ = kept * value_ + random->Gaussian(sigma_) * std::sqrt(1 - kept * kept);
  }

 private:
  double sigma_, correlation_s_, value_;
};

/// A generator of its own for each of the sensors of a flight: what one draws, no other notices.
inline Random StreamOf(int seed, int stream) {
  constexpr uint64_t kGoldenGamma = 0x9e3779b97f4a7c15;  // SplitMix64 (Steele et al. 2014)
  uint64_t mixed = (static_cast<uint64_t>(seed) << 32) + static_cast<uint64_t>(stream);
  mixed = (mixed + kGoldenGamma) * 0xbf58476d1ce4e5b9;
  return Random(mixed ^ (mixed >> 31));
}

}  // namespace deepuav
