#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "deepuav/base/time.h"
#include "deepuav/system/frames/image_source.h"

namespace deepuav {

/// Gives the images of `images` at the pace of their time stamps; leaves out, unread, those that a
/// newer one has overtaken by the time it is asked. While it leaves out or waits for an image's
/// time it asks `stop`, if given, in whatever thread it was called, and ends when that says true.
class LiveImages : public ImageSource {
 public:
  explicit LiveImages(ImageSource* images, std::function<bool()> stop = nullptr)
      : images_(images), stop_(std::move(stop)) {}
  std::optional<TimedImage> Next() override;
  std::optional<Timestamp> UpcomingTime(int ahead) const override {
    return images_->UpcomingTime(ahead);
  }
  void Skip() override { images_->Skip(); }
  int skipped() const { return skipped_; }

 private:
  double SecondsUntil(Timestamp time) const;
  /// Leaves out what was overtaken; false where it was stopped.
  bool CatchUp();
  /// False where it was stopped.
  bool WaitFor(Timestamp time) const;

  ImageSource* images_;
  const std::function<bool()> stop_;
  std::optional<Timestamp> first_time_;
  Stopwatch since_first_;
  int skipped_ = 0;
};

}  // namespace deepuav
