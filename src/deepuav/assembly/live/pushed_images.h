#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

#include "deepuav/geometry/camera.h"
#include "deepuav/sensors/streams.h"
#include "deepuav/system/frames/image_source.h"

namespace deepuav {

/// How images wait for the run.
struct PushedImagesOptions {
  size_t capacity = 4;       ///< Images that may wait.
  bool newest_only = false;  ///< One waits at most: a newer one takes its place.
  /// Images wait for the inertial samples until the end of their readout: what the camera turned by
  /// comes with them.
  bool with_turns = false;
  double max_imu_gap_s = 0;  ///< Between samples that are interpolated.
  /// An image read at once does not wait for a sensor whose last sample is older than this.
  double silent_after_s = 1;
  /// None waits longer for samples, once the newest was pushed; nothing: as long as it takes.
  std::optional<double> max_wait_s = {};
  /// Of the latest samples, so many at least are kept for the run's end, and half as many again at
  /// most; 0: all are.
  size_t kept_samples = 0;
};

/// Images that are pushed by one thread and taken by another: the run. Thread-safe.
class PushedImages : public ImageSource {
 public:
  /// `imu`: where the sensor is, and its noise; without samples.
  PushedImages(const Camera& camera, ImuStream imu, const PushedImagesOptions& options);

  /// Waits for room, unless only the newest is kept. An image that waits for inertial samples when
  /// there is no room left goes with those that are there. Returns false once closed. Throws Error
  /// for a time that does not come after that of the image before.
  bool Push(GreyImage image, Timestamp time, double decode_s);
  /// Throws Error for a time that does not come after the last sample's, or numbers that are not
  /// finite.
  void PushImu(const ImuSample& sample);
  /// No more images are taken; those inside are still given, with the samples that are there.
  void Close();
  /// Those inside are not given any more either.
  void Abandon();

  /// The stream with the samples pushed, as far as they are kept. Only once closed.
  ImuStream TakeImu();
  int pushed() const;
  /// Overtaken by newer ones.
  int skipped() const;

  std::optional<TimedImage> Next() override;
  std::optional<Timestamp> UpcomingTime(int /*ahead*/) const override { return std::nullopt; }
  void Skip() override {}
  bool KeepsPace() const override { return options_.newest_only; }

 private:
  bool HasRoom() const { return options_.newest_only || images_.size() < options_.capacity; }
  /// Whether the samples reach beyond the first image's readout.
  bool FrontIsCovered() const;
  bool MayGoUncovered() const;
  bool MayGive() const;
  bool HasWaited() const;
  bool IsSilentAt(Timestamp time) const;
  void AddTurns(TimedImage* image) const;

  const Camera camera_;
  const PushedImagesOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable room_, filled_;
  ImuStream imu_;
  std::deque<TimedImage> images_;
  std::optional<Timestamp> last_time_;   ///< Of images pushed...
  std::optional<Timestamp> given_time_;  ///< ...and given.
  Stopwatch since_push_;                 ///< Of the newest.
  int pushed_ = 0, skipped_ = 0;
  int blocked_ = 0;             ///< Calls of Push that wait for room.
  bool waits_in_vain_ = false;  ///< The image before was overtaken before its samples came.
  bool closed_ = false;
};

}  // namespace deepuav
