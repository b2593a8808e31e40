#include "deepuav/autopilot/autopilot_observer.h"

#include <cmath>
#include <limits>
#include <ranges>
#include <utility>

namespace deepuav {
namespace {

constexpr size_t kMostMetrics = 256;
constexpr int64_t kNewest = std::numeric_limits<int64_t>::max();

/// With the heading and the origin of those before.
MetricFromMap GoingOn(const MetricFromMap& before, MetricFromMap now) {
  const Eigen::Vector3d origin_in_map = before.metric_from_map.Inverse() * Eigen::Vector3d::Zero();
  const Eigen::Vector3d x =
      (before.metric_from_map.rotation() * now.metric_from_map.rotation().conjugate()) *
      Eigen::Vector3d::UnitX();
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(std::atan2(x.y(), x.x()), Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d origin = turn * (now.metric_from_map * origin_in_map);
  now.metric_from_map = Sim3(1, turn, -origin) * now.metric_from_map;
  return now;
}

}  // namespace

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
  const std::optional<MetricFromMap> before = MetricIn(map, kNewest);
  const bool goes_on = before && metric && !before->origin && !metric->origin;
  Keep({map, revision, goes_on ? GoingOn(*before, *metric) : metric});
}

void AutopilotObserver::Keep(MetricSince since) {
  const std::optional<MetricFromMap> before = MetricIn(since.map, kNewest);
  if (before && before->origin && since.metric && !since.metric->origin) return;
  metrics_.push_back(std::move(since));
  if (metrics_.size() > kMostMetrics) metrics_.pop_front();
}

void AutopilotObserver::OnMap(const MapEvent& event) {
  if (event.change != MapChange::kMerged) return;
  const std::scoped_lock lock(mutex_);
  const std::optional<MetricFromMap> known = MetricIn(event.into, kNewest);
  std::optional<MetricFromMap> metric = MetricIn(event.map, kNewest);
  if (!metric || (known && (known->origin || !metric->origin))) return;
  metric->metric_from_map = metric->metric_from_map * event.into_from_map.Inverse();
  Keep({event.into, event.revision, metric});
}

std::optional<MetricFromMap> AutopilotObserver::MetricIn(MapId map, int64_t revision) const {
  for (const MetricSince& since : std::views::reverse(metrics_)) {
    if (since.map == map && since.revision <= revision) return since.metric;
  }
  return std::nullopt;
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
  estimator_.Add(image, MetricIn(record.map, record.map_revision));
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
