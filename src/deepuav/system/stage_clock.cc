#include "deepuav/system/stage_clock.h"

namespace deepuav {

void StageClock::Begin(const char* stage) {
  std::scoped_lock lock(mutex_);
  running_[{std::this_thread::get_id(), stage}].Restart();
}

void StageClock::End(const char* stage) {
  std::scoped_lock lock(mutex_);
  const auto running = running_.find({std::this_thread::get_id(), stage});
  if (running == running_.end()) return;
  durations_s_[stage].push_back(running->second.Seconds());
  running_.erase(running);
}

void StageClock::Add(const std::string& stage, double seconds) {
  std::scoped_lock lock(mutex_);
  durations_s_[stage].push_back(seconds);
}

std::map<std::string, std::vector<double>> StageClock::Durations() const {
  std::scoped_lock lock(mutex_);
  return durations_s_;
}

}  // namespace deepuav
