#pragma once

#include <exception>
#include <iostream>

namespace deepuav {

/// What a bench's main returns: the exit status of `work`, or 1 where that throws, which is told.
template <typename Work>
int RunBench(const char* name, const Work& work) {
  try {
    return work();
  } catch (const std::exception& error) {
    std::cerr << name << ": " << error.what() << "\n";
    return 1;
  }
}

}  // namespace deepuav
