#include "deepuav/capture/dataset_source.h"

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/base/wait.h"

namespace deepuav {
namespace {

/// From the first image to the first of the next loop: an image's time after the last one.
int64_t LoopPeriod(const Dataset& dataset) {
  const int size = dataset.size();
  constexpr int64_t kOnlyImage = 100'000'000;
  if (size < 2) return kOnlyImage;
  const int64_t span = dataset.Time(size - 1).nanoseconds - dataset.Time(0).nanoseconds;
  return span + span / (size - 1);
}

}  // namespace

void DatasetPace::Check() const { CheckOptions("", *this); }

DatasetSource::DatasetSource(Dataset* dataset, std::string name, const DatasetPace& pace)
    : dataset_(dataset), name_(std::move(name)), pace_(pace), period_ns_(LoopPeriod(*dataset)) {
  pace_.Check();
}

void DatasetSource::Open() {
  next_ = 0;
  since_open_.Restart();
}

Timestamp DatasetSource::TimeInLoops(int64_t frame) const {
  const int64_t loop = frame / dataset_->size();
  const Timestamp time = dataset_->Time(static_cast<int>(frame % dataset_->size()));
  return {time.nanoseconds + loop * period_ns_};
}

double DatasetSource::SecondsUntil(int64_t frame) const {
  return SecondsBetween(dataset_->Time(0), TimeInLoops(frame)) / pace_.speed -
         since_open_.Seconds();
}

void DatasetSource::LeaveOutLate() {
  for (; IsThere(next_ + 1) && SecondsUntil(next_ + 1) <= 0; ++next_) ++late_;
}

std::optional<LiveImage> DatasetSource::Next(const std::function<bool()>& stop) {
  LeaveOutLate();
  for (; IsThere(next_); ++next_) {
    WaitUnless(stop, SecondsUntil(next_));
    if (stop && stop()) return std::nullopt;
    const auto frame = static_cast<int>(next_ % dataset_->size());
    try {
      LiveImage image{dataset_->Load(frame), TimeInLoops(next_)};
      ++next_;
      return image;
    } catch (const Error& error) {
      Log().warn("frame {} left out: {}", frame, error.what());
    }
  }
  return std::nullopt;
}

}  // namespace deepuav
