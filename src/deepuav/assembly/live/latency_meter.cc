#include "deepuav/assembly/live/latency_meter.h"

#include <algorithm>

namespace deepuav {

void LatencyMeter::Arrived(Timestamp time, const Stopwatch& since_arrival) {
  const std::scoped_lock lock(mutex_);
  under_way_.emplace_back(time, since_arrival);
  if (under_way_.size() > kUnderWay) under_way_.pop_front();
}

void LatencyMeter::Done(Timestamp time) {
  const std::scoped_lock lock(mutex_);
  while (!under_way_.empty() && under_way_.front().first < time) under_way_.pop_front();
  if (under_way_.empty() || under_way_.front().first != time) return;
  latencies_s_.push_back(static_cast<float>(under_way_.front().second.Seconds()));
  under_way_.pop_front();
  if (latencies_s_.size() > kRemembered) latencies_s_.pop_front();
}

LatencyMeter::Latencies LatencyMeter::Latest(size_t most) const {
  std::vector<float> latest;
  {
    const std::scoped_lock lock(mutex_);
    const auto count = static_cast<std::ptrdiff_t>(std::min(most, latencies_s_.size()));
    latest.assign(latencies_s_.end() - count, latencies_s_.end());
  }
  if (latest.empty()) return {};
  Latencies latencies;
  latencies.newest_s = latest.back();
  latencies.count = static_cast<int64_t>(latest.size());
  std::sort(latest.begin(), latest.end());
  const auto at = [&latest](double share) {
    return latest[static_cast<size_t>(share * static_cast<double>(latest.size() - 1) + 0.5)];
  };
  latencies.median_s = at(0.5);
  latencies.p95_s = at(0.95);
  return latencies;
}

}  // namespace deepuav
