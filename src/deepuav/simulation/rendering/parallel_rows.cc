#include "deepuav/simulation/rendering/parallel_rows.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace deepuav {

void ForRowsInParallel(int rows, int threads,
                       const std::function<void(int first, int last)>& work) {
  const int bands = (rows + kBandRows - 1) / kBandRows;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int count = std::min(threads == 0 ? cores : threads, bands);
  std::atomic<int> next = 0;
  std::mutex failure_mutex;
  std::exception_ptr failure;
  const auto run = [&] {
    try {
      for (int band = next++; band < bands; band = next++) {
        work(band * kBandRows, std::min((band + 1) * kBandRows, rows));
      }
    } catch (...) {
      next = bands;
      const std::lock_guard lock(failure_mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int i = 1; i < count; ++i) helpers.emplace_back(run);
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace deepuav
