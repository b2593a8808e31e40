#include "deepuav/assembly/live/pushed_images.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "deepuav/assembly/live/live_limits.h"
#include "deepuav/base/error.h"
#include "deepuav/inertial/camera_turns.h"

namespace deepuav {
namespace {

Timestamp Shifted(Timestamp time, double seconds) {
  return {time.nanoseconds + static_cast<int64_t>(std::llround(1e9 * seconds))};
}

bool Earlier(const ImuSample& sample, Timestamp time) { return sample.time < time; }

}  // namespace

PushedImages::PushedImages(const Camera& camera, ImuStream imu, const PushedImagesOptions& options)
    : camera_(camera), options_(options), imu_(std::move(imu)) {}

bool PushedImages::Push(GreyImage image, Timestamp time, double decode_s) {
  std::unique_lock lock(mutex_);
  if (last_time_ && time <= *last_time_) {
    throw Error("image of time {} ns: expected a later time than {} ns, that of the one before",
                time.nanoseconds, last_time_->nanoseconds);
  }
  if (!HasRoom()) {
    ++blocked_;
    filled_.notify_one();
    room_.wait(lock, [this] { return closed_ || HasRoom(); });
    --blocked_;
  }
  if (closed_) return false;
  if (options_.newest_only && !images_.empty()) {
    waits_in_vain_ = !FrontIsCovered();
    images_.clear();
    ++skipped_;
  }
  last_time_ = time;
  since_push_.Restart();
  images_.push_back({FrameId{pushed_++}, time, std::move(image), decode_s});
  filled_.notify_one();
  return true;
}

void PushedImages::PushImu(const ImuSample& sample) {
  if (!sample.angular_velocity.allFinite() || !sample.specific_force.allFinite())
    throw Error("inertial sample of time {} ns: expected finite numbers", sample.time.nanoseconds);
  const std::scoped_lock lock(mutex_);
  if (!imu_.samples.empty() && sample.time <= imu_.samples.back().time) {
    throw Error("inertial sample of time {} ns: expected a later time than {} ns, the last one's",
                sample.time.nanoseconds, imu_.samples.back().time.nanoseconds);
  }
  imu_.samples.push_back(sample);
  ForgetOldest(options_.kept_samples, &imu_.samples);
  filled_.notify_one();
}

void PushedImages::Close() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
  room_.notify_all();
  filled_.notify_all();
}

void PushedImages::Abandon() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
  images_.clear();
  room_.notify_all();
  filled_.notify_all();
}

ImuStream PushedImages::TakeImu() {
  const std::scoped_lock lock(mutex_);
  return std::move(imu_);
}

int PushedImages::pushed() const {
  const std::scoped_lock lock(mutex_);
  return pushed_;
}

int PushedImages::skipped() const {
  const std::scoped_lock lock(mutex_);
  return skipped_;
}

bool PushedImages::FrontIsCovered() const {
  if (!options_.with_turns || IsSilentAt(images_.front().time)) return true;
  const Timestamp end = Shifted(images_.front().time, camera_.readout_s / 2);
  return !imu_.samples.empty() && imu_.samples.back().time >= end;
}

/// The turn within a readout is worth waiting for; that between images only helps to predict.
bool PushedImages::IsSilentAt(Timestamp time) const {
  if (camera_.readout_s > 0) return false;
  return imu_.samples.empty() || imu_.samples.back().time < Shifted(time, -options_.silent_after_s);
}

/// Who waits to push an image may be the one who would push the samples.
bool PushedImages::MayGoUncovered() const { return waits_in_vain_ || (blocked_ > 0 && !HasRoom()); }

bool PushedImages::HasWaited() const {
  return options_.max_wait_s && since_push_.Seconds() >= *options_.max_wait_s;
}

bool PushedImages::MayGive() const {
  return closed_ || (!images_.empty() && (FrontIsCovered() || MayGoUncovered() || HasWaited()));
}

std::optional<TimedImage> PushedImages::Next() {
  std::unique_lock lock(mutex_);
  while (!MayGive()) {
    if (images_.empty() || !options_.max_wait_s) {
      filled_.wait(lock);
    } else {
      const double left_s = *options_.max_wait_s - since_push_.Seconds();
      filled_.wait_for(lock, std::chrono::duration<double>(left_s));
    }
  }
  if (images_.empty()) return std::nullopt;
  waits_in_vain_ = false;
  TimedImage image = std::move(images_.front());
  images_.pop_front();
  if (options_.with_turns) AddTurns(&image);
  given_time_ = image.time;
  room_.notify_one();
  return image;
}

/// By the samples since the image before and around the readout, which tell the same as all of
/// them.
void PushedImages::AddTurns(TimedImage* image) const {
  const auto& samples = imu_.samples;
  const double half_s = camera_.readout_s / 2;
  const Timestamp begin = Shifted(image->time, -half_s), end = Shifted(image->time, half_s);
  auto first = std::lower_bound(samples.begin(), samples.end(),
                                std::min(begin, given_time_.value_or(begin)), Earlier);
  auto last = std::lower_bound(first, samples.end(), end, Earlier);
  if (first != samples.begin()) --first;
  if (last != samples.end()) ++last;
  const ImuStream around{imu_.source, imu_.noise, imu_.cam_from_imu, {first, last}};
  const CameraTurns turns(around, options_.max_imu_gap_s, camera_);
  image->turn_in_readout = turns.DuringReadout(image->time);
  if (given_time_) image->turn_since_before = turns.Between(*given_time_, image->time);
}

}  // namespace deepuav
