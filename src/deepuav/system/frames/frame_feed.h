#pragma once

#include <exception>
#include <optional>
#include <thread>

#include "deepuav/base/queue.h"
#include "deepuav/features/extractor.h"
#include "deepuav/inertial/camera_turns.h"
#include "deepuav/map/frame.h"
#include "deepuav/system/frames/image_source.h"
#include "deepuav/system/watching/stage_clock.h"

namespace deepuav {

/// Frames with their features, one after the other.
class FrameFeed {
 public:
  virtual ~FrameFeed() = default;
  /// Nothing at the end. Throws what reading or extraction threw.
  virtual std::optional<Frame> Next() = 0;
};

/// Reads and extracts when asked.
class SequentialFeed : public FrameFeed {
 public:
  /// All arguments must outlive it. `turns`: of the camera; null: not known.
  SequentialFeed(ImageSource* images, Extractor* extractor, StageClock* clock,
                 const CameraTurns* turns = nullptr);
  std::optional<Frame> Next() override;

 private:
  /// `turn`: as the image's source knows it.
  void CorrectForTurn(std::optional<ReadoutMotion> turn, Frame* frame) const;
  /// By which the camera has turned since the image before.
  std::optional<Eigen::Quaterniond> TurnTo(const TimedImage& image);

  ImageSource* images_;
  Extractor* extractor_;
  StageClock* clock_;
  const CameraTurns* turns_;
  std::optional<Timestamp> last_time_;
};

/// Reads and extracts ahead on a thread of its own.
class PrefetchingFeed : public FrameFeed {
 public:
  /// The arguments must outlive it. `frames_ahead`: how many frames may wait.
  PrefetchingFeed(FrameFeed* feed, int frames_ahead);
  ~PrefetchingFeed() override;
  std::optional<Frame> Next() override;

 private:
  void Work();

  FrameFeed* feed_;
  BoundedQueue<Frame> queue_;
  std::exception_ptr failure_;  ///< Written before the queue is closed, read after.
  std::thread thread_;
};

}  // namespace deepuav
