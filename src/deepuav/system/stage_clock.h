#pragma once

#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "deepuav/base/stages.h"
#include "deepuav/base/time.h"

namespace deepuav {

/// Measures how long each stage took, each time. Thread-safe: every thread's stages are its own.
class StageClock : public StageListener {
 public:
  void Begin(const char* stage) override;
  void End(const char* stage) override;

  /// Adds a duration measured elsewhere.
  void Add(const std::string& stage, double seconds);

  /// Durations of every stage, in the order they ended, in seconds.
  std::map<std::string, std::vector<double>> Durations() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::thread::id, std::string>, Stopwatch> running_;
  std::map<std::string, std::vector<double>> durations_s_;
};

}  // namespace deepuav
