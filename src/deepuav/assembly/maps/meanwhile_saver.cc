#include "deepuav/assembly/maps/meanwhile_saver.h"

#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {

MeanwhileSaver::MeanwhileSaver(std::filesystem::path folder, double every_s)
    : folder_(std::move(folder)), every_s_(every_s), thread_([this] { Work(); }) {}

MeanwhileSaver::~MeanwhileSaver() { Stop(); }

void MeanwhileSaver::Stop() {
  {
    const std::scoped_lock lock(mutex_);
    stopped_ = true;
  }
  filled_.notify_one();
  if (thread_.joinable()) thread_.join();
}

bool MeanwhileSaver::Due() {
  const std::scoped_lock lock(mutex_);
  if (every_s_ <= 0 || is_busy_ || stopped_ || since_saved_.Seconds() < every_s_) return false;
  is_busy_ = true;
  return true;
}

void MeanwhileSaver::Save(FinishedRun run) {
  {
    const std::scoped_lock lock(mutex_);
    if (stopped_) return;
    waiting_ = std::move(run);
  }
  filled_.notify_one();
}

void MeanwhileSaver::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    filled_.wait(lock, [this] { return stopped_ || waiting_; });
    if (stopped_) return;
    std::optional<FinishedRun> run = std::exchange(waiting_, std::nullopt);
    lock.unlock();
    try {
      const Stopwatch writing;
      WriteRunOutput(folder_, *run);
      Log().debug("saved {} frames in {:.2f} s", run->result.frames.size(), writing.Seconds());
    } catch (const std::exception& error) {
      Log().warn("what there is of the run could not be saved: {}", error.what());
    }
    run.reset();
    lock.lock();
    is_busy_ = false;
    since_saved_.Restart();
  }
}

}  // namespace deepuav
