#include "deepuav/system/frames/live_images.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

namespace deepuav {
namespace {

constexpr double kStopInterval = 0.05;  ///< Seconds between two questions whether to stop.

void WaitSeconds(double seconds) {
  std::mutex mutex;
  std::condition_variable never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, std::chrono::duration<double>(seconds), [] { return false; });
}

}  // namespace

std::optional<TimedImage> LiveImages::Next() {
  if (!CatchUp()) return std::nullopt;
  std::optional<TimedImage> image = images_->Next();
  if (!image) return std::nullopt;
  if (!first_time_) {
    first_time_ = image->time;
    since_first_.Restart();
  }
  if (!WaitFor(image->time)) return std::nullopt;
  return image;
}

bool LiveImages::CatchUp() {
  if (!first_time_) return true;
  for (auto after = images_->UpcomingTime(1); after && SecondsUntil(*after) <= 0;
       after = images_->UpcomingTime(1)) {
    if (stop_ && stop_()) return false;
    images_->Skip();
    ++skipped_;
  }
  return true;
}

bool LiveImages::WaitFor(Timestamp time) const {
  for (double wait_s = SecondsUntil(time); wait_s > 0; wait_s = SecondsUntil(time)) {
    if (stop_ && stop_()) return false;
    WaitSeconds(std::min(wait_s, kStopInterval));
  }
  return true;
}

double LiveImages::SecondsUntil(Timestamp time) const {
  return SecondsBetween(*first_time_, time) - since_first_.Seconds();
}

}  // namespace deepuav
