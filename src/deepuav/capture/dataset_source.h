#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/capture/live_source.h"
#include "deepuav/io/datasets/dataset.h"

namespace deepuav {

struct DatasetPace {
  bool loop = false;  ///< From the end on to the beginning again; times go on.
  double speed = 1;   ///< Seconds of the dataset a second.

  /// Throws Error for a speed that cannot be.
  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("loop", loop, "", "from the end on to the beginning again");
    visit("speed", speed, "", "seconds of the dataset a second", Between(0.01, 1000));
  }
};

/// A dataset's or a video's images at the pace at which they were taken. Images that are late
/// before they are read are left out; so are those that cannot be read, with a line in the log.
class DatasetSource : public LiveSource {
 public:
  /// `dataset` must outlive it.
  DatasetSource(Dataset* dataset, std::string name, const DatasetPace& pace);

  /// From the beginning.
  void Open() override;
  std::optional<LiveImage> Next(const std::function<bool()>& stop) override;
  bool EndsForGood() const override { return true; }
  std::string Name() const override { return name_; }
  int64_t late() const override { return late_; }

 private:
  Timestamp TimeInLoops(int64_t frame) const;
  double SecondsUntil(int64_t frame) const;
  bool IsThere(int64_t frame) const { return pace_.loop || frame < dataset_->size(); }
  void LeaveOutLate();

  Dataset* dataset_;
  const std::string name_;
  const DatasetPace pace_;
  const int64_t period_ns_;  ///< Of a loop.
  Stopwatch since_open_;
  int64_t next_ = 0;  ///< Counted on over loops.
  int64_t late_ = 0;
};

}  // namespace deepuav
