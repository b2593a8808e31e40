#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace deepuav {

/// A bijection of 64-bit words that scatters every bit (the finaliser of SplitMix64, Steele et al.
/// 2014).
inline uint64_t MixBits(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

inline uint32_t HashCell(int32_t x, int32_t y, uint32_t seed) {
  const uint64_t cell = (static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32) |
                        static_cast<uint64_t>(static_cast<uint32_t>(y));
  return static_cast<uint32_t>(MixBits(cell ^ (static_cast<uint64_t>(seed) * 0xd6e8feb86659fd93u)));
}

/// Uniform in [0, 1) from a hash.
inline float UnitFromHash(uint32_t hash) { return static_cast<float>(hash >> 8) * 0x1p-24f; }

/// Perlin's gradient noise (2002, with quintic fade), about -1 to 1, one feature per unit. It
/// repeats every `period` units in both directions; 0 for never.
float GradientNoise(float x, float y, int period, uint32_t seed);
float GradientNoise(const Eigen::Vector3f& point, uint32_t seed);

/// A sum of octaves of gradient noise of double frequency and `persistence` times the amplitude
/// each, scaled to a standard deviation of about a quarter.
float FractalNoise(float x, float y, int period, int octaves, float persistence, uint32_t seed);

}  // namespace deepuav
