#include "deepuav/base/wait.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "deepuav/base/time.h"

namespace deepuav {

void WaitUnless(const std::function<bool()>& stop, double seconds) {
  constexpr double kStopInterval = 0.02;
  std::mutex mutex;
  std::condition_variable never;
  std::unique_lock lock(mutex);
  const Stopwatch waiting;
  for (double left = seconds; left > 0 && !(stop && stop()); left = seconds - waiting.Seconds()) {
    never.wait_for(lock, std::chrono::duration<double>(std::min(left, kStopInterval)),
                   [] { return false; });
  }
}

}  // namespace deepuav
