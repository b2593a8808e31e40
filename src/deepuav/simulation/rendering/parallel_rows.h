#pragma once

#include <functional>

namespace deepuav {

inline constexpr int kBandRows = 8;  ///< Of every band but perhaps the last.

/// Calls `work(first, last)` for bands of rows that together make [0, rows), on `threads` threads
/// (0: all cores), of which the calling one is one. An exception of any is thrown again here.
void ForRowsInParallel(int rows, int threads, const std::function<void(int first, int last)>& work);

}  // namespace deepuav
