#include "deepuav/autopilot/autopilot_observer.h"

#include <cmath>

namespace deepuav {
void AutopilotObserver::Arrived(Timestamp time, const Stopwatch& since_arrival) {
  // In this order a pause between the two adds to the delay: SteadyImageClock believes the least.
  const int64_t passed_ns = std::llround(1e9 * since_arrival.Seconds());
  const int64_t arrival_ns = SteadyNow() - passed_ns;
  const std::scoped_lock lock(mutex_);
  clock_.Arrived(time, arrival_ns);
  inertial_clock_.Arrived(time, arrival_ns);
}

void AutopilotObserver::UseMetric(MapId map, int64_t revision,
                                  const std::optional<MetricFromMap>& metric) {
  const std::scoped_lock lock(mutex_);
  worlds_.Use(map, revision, metric);
}

void AutopilotObserver::OnMap(const MapEvent& event) {
  const std::scoped_lock lock(mutex_);
  worlds_.OnMap(event);
}

void AutopilotObserver::OnGauge(MapId map, int64_t revision, const Gauge& gauge) {
  const std::scoped_lock lock(mutex_);
  worlds_.OnGauge(map, revision, gauge);
}

void AutopilotObserver::OnFrame(const FrameRecord& record, const Frame& /*frame*/) {
  const std::scoped_lock lock(mutex_);
  if (!record.located()) return estimator_.Lost();
  const LocatedImage image{clock_.SteadyOf(record.time).value_or(SteadyNow()),
                           record.map,
                           record.map_revision,
                           record.cam_from_world,
                           record.pose_information,
                           record.landmark_count};
  estimator_.Add(image, worlds_.In(record.map, record.map_revision));
}

std::optional<ImuSample> AutopilotObserver::AmongImages(ImuSample sample) {
  const std::scoped_lock lock(mutex_);
  const std::optional<int64_t> offset_ns = inertial_clock_.offset_ns();
  if (!offset_ns) return std::nullopt;
  sample.time.nanoseconds -= inertial_offset_.Towards(*offset_ns, sample.time.nanoseconds);
  if (last_inertial_ && sample.time <= *last_inertial_) return std::nullopt;
  last_inertial_ = sample.time;
  return sample;
}

/// A receiver's fixes are late by more than the clocks' jerks.
std::optional<GnssFix> AutopilotObserver::FixAmongImages(GnssFix fix) {
  const std::scoped_lock lock(mutex_);
  const std::optional<int64_t> offset_ns = inertial_clock_.offset_ns();
  if (!offset_ns) return std::nullopt;
  fix.time.nanoseconds -= *offset_ns;
  if (last_fix_ && fix.time <= *last_fix_) return std::nullopt;
  last_fix_ = fix.time;
  return fix;
}

void AutopilotObserver::AddInertial(const ImuSample& sample) {
  const std::scoped_lock lock(mutex_);
  estimator_.AddInertial(sample);
}

OdometryEstimator::Answer AutopilotObserver::At(int64_t time_ns) {
  const std::scoped_lock lock(mutex_);
  return estimator_.At(time_ns);
}

}  // namespace deepuav
