#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>

#include "deepuav/assembly/output/finished_run.h"

namespace deepuav {

/// Writes a run that goes on into its output folder now and then, on a thread of its own that no
/// one waits for.
class MeanwhileSaver {
 public:
  /// `every_s`: seconds between the end of one saving and the next; 0: never.
  MeanwhileSaver(std::filesystem::path folder, double every_s);
  /// Waits until what is being written is there.
  ~MeanwhileSaver();
  MeanwhileSaver(const MeanwhileSaver&) = delete;
  MeanwhileSaver& operator=(const MeanwhileSaver&) = delete;

  /// Whether it is time; then true only once until what is saved was taken and written.
  bool Due();
  /// To be called after Due() said true. What cannot be written is told in the log.
  void Save(FinishedRun run);
  /// Waits likewise; nothing is saved any more.
  void Stop();

 private:
  void Work();

  const std::filesystem::path folder_;
  const double every_s_;
  std::mutex mutex_;
  std::condition_variable filled_;
  std::optional<FinishedRun> waiting_;
  Stopwatch since_saved_;
  bool is_busy_ = false, stopped_ = false;
  std::thread thread_;
};

}  // namespace deepuav
