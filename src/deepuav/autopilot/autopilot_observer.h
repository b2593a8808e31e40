#pragma once

#include <mutex>

#include "deepuav/autopilot/gentle_offset.h"
#include "deepuav/autopilot/odometry_estimator.h"
#include "deepuav/autopilot/steady_image_clock.h"
#include "deepuav/sensors/samples.h"
#include "deepuav/system/sensors/known_worlds.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

/// Makes odometry of what happens in a run. Thread-safe; nobody waits for more than a few matrices.
class AutopilotObserver : public RunObserver {
 public:
  explicit AutopilotObserver(OdometryEstimator estimator) : estimator_(std::move(estimator)) {}

  /// An image came, so long ago; before it is told of as a frame.
  void Arrived(Timestamp time, const Stopwatch& since_arrival);
  /// As KnownWorlds::Use.
  void UseMetric(MapId map, int64_t revision, const std::optional<MetricFromMap>& metric);
  OdometryEstimator::Answer At(int64_t time_ns);
  /// Of the body's sensor, on the machine's clock: to predict by.
  void AddInertial(const ImuSample& sample);
  /// A sample on the machine's clock as one on the images', later than the one before; nothing
  /// before the first image, or where it is not.
  std::optional<ImuSample> AmongImages(ImuSample sample);
  std::optional<GnssFix> FixAmongImages(GnssFix fix);

  void OnFrame(const FrameRecord& record, const Frame& frame) override;
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& event) override;
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override;

 private:
  std::mutex mutex_;
  OdometryEstimator estimator_;
  SteadyImageClock clock_;
  /// Samples must not move against images: one that came without delay is among these, even where
  /// others use the machine for seconds.
  SteadyImageClock inertial_clock_{600, 10};
  GentleOffset inertial_offset_;  ///< From the images' clock to the machine's.
  std::optional<Timestamp> last_inertial_, last_fix_;
  KnownWorlds worlds_;
};

}  // namespace deepuav
