#pragma once

#include <cstdint>
#include <functional>

namespace deepuav {

/// Calls work(0) .. work(count - 1), each once, on up to `threads` threads, of which the caller's
/// is one. Returns when all are done; rethrows what one of them threw, and begins no more then.
void ForEachInParallel(int count, int threads, const std::function<void(int)>& work);

/// Of this machine; 1 where that is not known.
int CoreCount();

/// Part `part` of `parts` of the numbers from 0 to `count` - 1: [first, last).
struct PartOf {
  int first, last;
  PartOf(int count, int part, int parts)
      : first(static_cast<int>(int64_t{count} * part / parts)),
        last(static_cast<int>(int64_t{count} * (part + 1) / parts)) {}
};

}  // namespace deepuav
