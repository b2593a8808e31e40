#pragma once

#include <functional>
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

  /// From now on at least the latest `count` durations of a stage are remembered, at most twice so
  /// many; 0: all.
  void RememberLatest(size_t count) { latest_ = count; }
  /// `listener` is told of every duration, in the stage's thread. Set before the first stage.
  void Tell(std::function<void(const std::string& stage, double seconds)> listener) {
    listener_ = std::move(listener);
  }

  /// Durations of every stage, in the order they ended, in seconds.
  std::map<std::string, std::vector<double>> Durations() const;

 private:
  void Remember(const std::string& stage, double seconds);

  std::function<void(const std::string&, double)> listener_;
  size_t latest_ = 0;
  mutable std::mutex mutex_;
  std::map<std::pair<std::thread::id, std::string>, Stopwatch> running_;
  std::map<std::string, std::vector<double>> durations_s_;
};

}  // namespace deepuav
