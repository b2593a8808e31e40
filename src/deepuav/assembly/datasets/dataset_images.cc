#include "deepuav/assembly/datasets/dataset_images.h"

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"

namespace deepuav {

DatasetImages::DatasetImages(Dataset* dataset, const FrameRange& range)
    : dataset_(dataset),
      start_(range.start),
      end_(range.end < 0 ? dataset->size() : std::min(range.end, dataset->size())),
      stride_(range.stride),
      next_(range.start) {
  if (stride_ < 1) throw Error("--stride is {}: expected at least 1", stride_);
  if (start_ < 0 || start_ >= end_) {
    throw Error("frames {} up to {} of {}: expected at least one frame (--start, --end)",
                range.start, range.end, dataset->size());
  }
}

std::optional<TimedImage> DatasetImages::Next() {
  while (next_ < end_) {
    const auto frame = static_cast<int>(next_);
    next_ += stride_;
    try {
      const Stopwatch decoding;
      TimedImage image{FrameId{(frame - start_) / stride_}, dataset_->Time(frame),
                       dataset_->Load(frame)};
      image.decode_s = decoding.Seconds();
      const auto turn = turns_.find(image.time);
      if (turn != turns_.end()) {
        image.turn_in_readout = turn->second;
        image.turn_sigma_rad = turn_sigma_rad_;
      }
      return image;
    } catch (const Error& error) {
      ++unreadable_;
      Log().warn("frame {} left out: {}", frame, error.what());
    }
  }
  return std::nullopt;
}

void DatasetImages::Rewind() {
  next_ = start_;
  unreadable_ = 0;
}

std::optional<Timestamp> DatasetImages::UpcomingTime(int ahead) const {
  const int64_t frame = next_ + static_cast<int64_t>(ahead) * stride_;
  if (frame >= end_) return std::nullopt;
  return dataset_->Time(static_cast<int>(frame));
}

}  // namespace deepuav
