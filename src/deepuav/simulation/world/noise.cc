#include "deepuav/simulation/world/noise.h"

#include <array>
#include <cmath>

namespace deepuav {
namespace {

float Fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

float Mix(float a, float b, float t) { return a + t * (b - a); }

int Wrapped(int i, int period) {
  if (period == 0) return i;
  const int rest = i % period;
  return rest < 0 ? rest + period : rest;
}

float Slope(uint32_t hash, float x, float y) {
  constexpr float kDiagonal = 0.70710678f;
  static constexpr std::array<float, 16> kDirections = {
      1,         0,         -1,         0,         0,         1,          0,          -1,
      kDiagonal, kDiagonal, -kDiagonal, kDiagonal, kDiagonal, -kDiagonal, -kDiagonal, -kDiagonal};
  const size_t i = 2 * (hash >> 29);
  return kDirections[i] * x + kDirections[i + 1] * y;
}

float Slope(uint32_t hash, float x, float y, float z) {
  // The twelve edges of a cube, four of them twice.
  const uint32_t h = hash >> 28;
  const float u = h < 8 ? x : y;
  const float v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1) != 0 ? -u : u) + ((h & 2) != 0 ? -v : v);
}

}  // namespace

float GradientNoise(float x, float y, int period, uint32_t seed) {
  const float floor_x = std::floor(x), floor_y = std::floor(y);
  const int cell_x = static_cast<int>(floor_x), cell_y = static_cast<int>(floor_y);
  const float fx = x - floor_x, fy = y - floor_y;
  const auto corner = [&](int i, int j) {
    const uint32_t hash = HashCell(Wrapped(cell_x + i, period), Wrapped(cell_y + j, period), seed);
    return Slope(hash, fx - static_cast<float>(i), fy - static_cast<float>(j));
  };
  const float u = Fade(fx), v = Fade(fy);
  constexpr float kToUnit = 1.4142136f;
  return kToUnit * Mix(Mix(corner(0, 0), corner(1, 0), u), Mix(corner(0, 1), corner(1, 1), u), v);
}

float GradientNoise(const Eigen::Vector3f& point, uint32_t seed) {
  const Eigen::Vector3f floor = point.array().floor();
  const Eigen::Vector3i cell = floor.cast<int>();
  const Eigen::Vector3f f = point - floor;
  const auto corner = [&](int i, int j, int k) {
    const uint32_t hash = HashCell(cell.x() + i, cell.y() + j, HashCell(cell.z() + k, 0, seed));
    return Slope(hash, f.x() - static_cast<float>(i), f.y() - static_cast<float>(j),
                 f.z() - static_cast<float>(k));
  };
  const float u = Fade(f.x()), v = Fade(f.y()), w = Fade(f.z());
  const auto plane = [&](int k) {
    return Mix(Mix(corner(0, 0, k), corner(1, 0, k), u), Mix(corner(0, 1, k), corner(1, 1, k), u),
               v);
  };
  return Mix(plane(0), plane(1), w);
}

float FractalNoise(float x, float y, int period, int octaves, float persistence, uint32_t seed) {
  float sum = 0, power = 0, amplitude = 1, frequency = 1;
  for (int octave = 0; octave < octaves; ++octave) {
    const auto octave_seed = seed + static_cast<uint32_t>(octave) * 0x9e3779b9u;
    sum += amplitude * GradientNoise(x * frequency, y * frequency,
                                     period * static_cast<int>(frequency), octave_seed);
    power += amplitude * amplitude;
    amplitude *= persistence;
    frequency *= 2;
  }
  constexpr float kOctaveDeviation = 0.36f;
  return sum * (0.25f / (kOctaveDeviation * std::sqrt(power)));
}

}  // namespace deepuav
