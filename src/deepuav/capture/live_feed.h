#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "deepuav/capture/live_source.h"
#include "deepuav/capture/picture_judge.h"
#include "deepuav/capture/size_fitter.h"
#include "deepuav/capture/stream_clock.h"

namespace deepuav {

struct LiveFeedOptions {
  StreamClockOptions clock;
  PictureJudgeOptions picture;
  double first_wait_s = 0.5;   ///< Before a dropped link is opened again the second time...
  double longest_wait_s = 10;  ///< ...twice as long each time, up to this.
  double held_s = 10;          ///< A link that held for so long is opened again at once.
  bool was_open = false;       ///< Before: then a first opening that fails is tried again.
};

/// What came of a live source so far.
struct LiveCounts {
  int64_t arrived = 0;     ///< Images.
  int64_t late = 0;        ///< Others, that a file held and that were late before they were read.
  int64_t frozen = 0;      ///< Of these, left out as the same as before...
  int64_t misfits = 0;     ///< ...or for their proportions.
  int64_t reconnects = 0;  ///< Times that a dropped link came back.
  bool is_open = false;
  PictureState picture = PictureState::kMoving;
};

/// Who gets the images.
struct LiveSinks {
  /// Of the calibrated size, with times that grow. `arrival_s`: seconds since it arrived.
  std::function<void(GreyImage image, Timestamp time, const Stopwatch& since_arrival)> image;
  /// What happened to the link or the picture, in a line.
  std::function<void(const std::string& line)> say;
};

/// Takes images from a source as they come, whatever happens to it, and hands them on.
class LiveFeed {
 public:
  /// `source` must outlive it.
  LiveFeed(LiveSource* source, const cv::Size& calibrated, const LiveFeedOptions& options,
           LiveSinks sinks);

  /// Until the source ends for good or `stop` says true. Throws Error where it cannot be opened in
  /// the first place.
  void Run(const std::function<bool()>& stop);

  /// Thread-safe.
  LiveCounts counts() const;

 private:
  bool OpenFirst(const std::function<bool()>& stop);
  bool Reopen(const std::function<bool()>& stop);
  void Take(const LiveImage& image);
  void TellPicture(PictureState picture, Timestamp arrival);
  template <typename Change>
  void Count(Change change);

  LiveSource* source_;
  const LiveFeedOptions options_;
  const LiveSinks sinks_;
  const ArrivalClock arrival_clock_;
  StreamClock clock_;
  PictureJudge judge_;
  SizeFitter fitter_;
  PictureState picture_ = PictureState::kMoving;
  Timestamp picture_since_;
  double wait_s_ = 0;
  Stopwatch since_open_;
  mutable std::mutex mutex_;
  LiveCounts counts_;
};

}  // namespace deepuav
