#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace deepuav {

/// Rows of 8-bit integers in -127..127 (never -128), `dimension` apart, with a factor each.
struct ScaledRows {
  const int8_t* values = nullptr;
  const float* scales = nullptr;
  int rows = 0;
};

/// Dot products of 8-bit integers, written once for each instruction set. The sums are exact
/// integers, so all give the same results.
struct DotKernels {
  std::string name;

  int32_t (*dot)(const int8_t* a, const int8_t* b, int dimension);

  /// out[i * b.rows + j] = <row i of a, row j of b> * (scale i of a * scale j of b).
  void (*matrix)(const ScaledRows& a, const ScaledRows& b, int dimension, float* out);
};

/// What this CPU can run, the portable one first, the fastest last.
const std::vector<DotKernels>& AvailableDotKernels();

/// The fastest.
inline const DotKernels& FastestDotKernels() { return AvailableDotKernels().back(); }

}  // namespace deepuav
