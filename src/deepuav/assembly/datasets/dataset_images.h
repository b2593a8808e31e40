#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "deepuav/io/datasets/dataset.h"
#include "deepuav/system/frames/image_source.h"

namespace deepuav {

/// Which frames of a dataset are run.
struct FrameRange {
  int start = 0;   ///< First frame.
  int end = -1;    ///< One past the last; -1: all.
  int stride = 1;  ///< Every stride-th.
};

/// A dataset's images in order; those that cannot be read are logged, counted and left out.
class DatasetImages : public ImageSource {
 public:
  /// `dataset` must outlive it. Throws Error for a range that holds no frame.
  DatasetImages(Dataset* dataset, const FrameRange& range);

  std::optional<TimedImage> Next() override;
  std::optional<Timestamp> UpcomingTime(int ahead) const override;
  void Skip() override { next_ += stride_; }
  /// Back to the first frame.
  void Rewind();
  /// How the camera turned while it read some of the images, as well as that is known.
  void KnowTurns(std::map<Timestamp, ReadoutMotion> turns, double sigma_rad) {
    turns_ = std::move(turns);
    turn_sigma_rad_ = sigma_rad;
  }
  int count() const { return 1 + (end_ - start_ - 1) / stride_; }
  int unreadable() const { return unreadable_; }

 private:
  Dataset* dataset_;
  int start_, end_, stride_;
  int64_t next_;  ///< May go beyond the last frame by a stride.
  int unreadable_ = 0;
  std::map<Timestamp, ReadoutMotion> turns_;
  double turn_sigma_rad_ = 0;
};

}  // namespace deepuav
