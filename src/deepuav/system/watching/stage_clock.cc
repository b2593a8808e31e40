#include "deepuav/system/watching/stage_clock.h"

namespace deepuav {

void StageClock::Begin(const char* stage) {
  std::scoped_lock lock(mutex_);
  running_[{std::this_thread::get_id(), stage}].Restart();
}

void StageClock::End(const char* stage) {
  double seconds = 0;
  {
    std::scoped_lock lock(mutex_);
    const auto running = running_.find({std::this_thread::get_id(), stage});
    if (running == running_.end()) return;
    seconds = running->second.Seconds();
    running_.erase(running);
    Remember(stage, seconds);
  }
  if (listener_) listener_(stage, seconds);
}

void StageClock::Add(const std::string& stage, double seconds) {
  {
    std::scoped_lock lock(mutex_);
    Remember(stage, seconds);
  }
  if (listener_) listener_(stage, seconds);
}

void StageClock::Remember(const std::string& stage, double seconds) {
  std::vector<double>& durations_s = durations_s_[stage];
  if (latest_ > 0 && durations_s.size() >= 2 * latest_) {
    durations_s.erase(durations_s.begin(),
                      durations_s.begin() + static_cast<std::ptrdiff_t>(latest_));
  }
  durations_s.push_back(seconds);
}

std::map<std::string, std::vector<double>> StageClock::Durations() const {
  std::scoped_lock lock(mutex_);
  return durations_s_;
}

}  // namespace deepuav
