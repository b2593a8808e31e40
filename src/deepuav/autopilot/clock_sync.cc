#include "deepuav/autopilot/clock_sync.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr size_t kMostOpen = 16, kLatest = 8;
constexpr int64_t kMillisecond = 1'000'000;
constexpr int64_t kMostDelay = 200 * kMillisecond;
/// An answer may have come half of its delay earlier or later than it seems: a slow one is enough
/// only where no faster one comes.
constexpr int64_t kSureDelay = 20 * kMillisecond;
constexpr size_t kEnoughSlow = 5;
constexpr int64_t kContradiction = 100 * kMillisecond;  // An autopilot that began anew.
constexpr int kSureContradictions = 3;
constexpr double kMostSlew = 1e-3;                // Seconds a second.
constexpr int64_t kMostClock = int64_t{1} << 61;  // 73 years.

}  // namespace

int64_t ClockSync::Ask(int64_t now_ns) {
  open_.push_back(now_ns);
  if (open_.size() > kMostOpen) open_.pop_front();
  return now_ns;
}

void ClockSync::Answer(int64_t autopilot_ns, int64_t mark_ns, int64_t now_ns) {
  const auto question = std::find(open_.begin(), open_.end(), mark_ns);
  if (question == open_.end()) return;
  open_.erase(question);
  const int64_t delay_ns = now_ns - mark_ns;
  if (autopilot_ns <= 0 || autopilot_ns > kMostClock || delay_ns > kMostDelay) return;
  const int64_t offset_ns = autopilot_ns - (mark_ns + delay_ns / 2);
  bool is_sure = delay_ns <= kSureDelay;
  if (is_known_ && std::abs(offset_ns - offset_ns_) > kContradiction) {
    if (++contradictions_ < kSureContradictions) return;
    is_sure = true;  // The clock before is surely wrong.
    samples_.clear();
    is_known_ = false;
  }
  contradictions_ = 0;
  samples_.push_back({offset_ns, delay_ns});
  if (samples_.size() > kLatest) samples_.pop_front();
  const auto best =
      std::min_element(samples_.begin(), samples_.end(),
                       [](const Sample& a, const Sample& b) { return a.delay_ns < b.delay_ns; });
  if (!is_known_ && !is_sure && samples_.size() < kEnoughSlow) return;
  Approach(best->offset_ns, now_ns);
}

/// Slowly, so that times go on to grow.
void ClockSync::Approach(int64_t offset_ns, int64_t now_ns) {
  const double most_ns = kMostSlew * static_cast<double>(now_ns - approached_ns_);
  approached_ns_ = now_ns;
  if (!is_known_) {
    is_known_ = true;
    offset_ns_ = offset_ns;
    return;
  }
  const auto step_ns = static_cast<double>(offset_ns - offset_ns_);
  offset_ns_ += std::llround(std::clamp(step_ns, -most_ns, most_ns));
}

}  // namespace deepuav
