#pragma once

#include <mutex>

#include "deepuav/sensors/streams.h"

namespace deepuav {

/// Samples of an inertial sensor that come while they are asked for, of which only the latest are
/// kept. Thread-safe.
class ImuWindow {
 public:
  /// `imu`: the sensor, with the samples that are there already. Once more come, those that are
  /// older than the newest by more than `keep_s` are forgotten, sooner or later.
  ImuWindow(ImuStream imu, double keep_s) : imu_(std::move(imu)), keep_s_(keep_s) {}

  /// One that is not later than the one before is left aside.
  void Add(const ImuSample& sample);
  /// The sensor with the samples from `first` on that are before `end`.
  ImuStream Between(Timestamp first, Timestamp end) const;
  size_t size() const;

 private:
  mutable std::mutex mutex_;
  ImuStream imu_;
  const double keep_s_;
};

}  // namespace deepuav
