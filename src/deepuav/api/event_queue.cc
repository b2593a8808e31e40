#include "deepuav/api/event_queue.h"

#include <algorithm>
#include <utility>

#include "deepuav/api/conversions.h"
#include "deepuav/base/logging.h"

namespace deepuav::api {

static_assert(static_cast<int>(MapChange::kAdjusted) ==
              static_cast<int>(core::MapChange::kAdjusted));

EventQueue::EventQueue(Observer* observer, size_t capacity)
    : observer_(observer),
      capacity_(std::max<size_t>(capacity, 1)),
      thread_([this] { Deliver(); }) {}

EventQueue::~EventQueue() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
  }
  filled_.notify_one();
  thread_.join();
}

void EventQueue::OnFrame(const FrameRecord& record, const core::Frame& /*frame*/) {
  Push(FrameEvent{FrameOf(record), MetricOf(record)});
}

std::optional<MetricPose> EventQueue::MetricOf(const FrameRecord& record) {
  if (!record.located()) return std::nullopt;
  std::optional<MetricFromMap> metric;
  {
    const std::scoped_lock lock(worlds_mutex_);
    metric = worlds_.In(record.map, record.map_revision);
  }
  if (!metric) return std::nullopt;
  const SE3 cam_from_metric = metric->metric_from_map.MovePose(record.cam_from_world);
  const GeoPoint origin = metric->origin.value_or(GeoPoint{});
  return MetricPose{metric->origin ? GaugeKind::kGeoreferenced : GaugeKind::kMetric,
                    ToApi(cam_from_metric.Inverse()),
                    metric->scale_sigma,
                    origin.latitude_deg,
                    origin.longitude_deg,
                    origin.altitude_m};
}

void EventQueue::UseMetric(MapId map, int64_t revision, const MetricFromMap& metric) {
  const std::scoped_lock lock(worlds_mutex_);
  worlds_.Use(map, revision, metric);
}

void EventQueue::OnGauge(MapId map, int64_t revision, const Gauge& gauge) {
  const std::scoped_lock lock(worlds_mutex_);
  worlds_.OnGauge(map, revision, gauge);
}

void EventQueue::OnRestart() {
  {
    const std::scoped_lock lock(worlds_mutex_);
    worlds_ = {};
  }
  Push(Restart{});
}

void EventQueue::OnKeyframe(core::KeyframeEvent event) {
  KeyframeEvent told;
  told.keyframe = {event.id.value,
                   event.time.nanoseconds,
                   static_cast<int>(event.map.value),
                   ToApi(event.cam_from_world.Inverse()),
                   {}};
  told.frame = event.frame.value;
  told.new_landmarks_world.reserve(event.new_landmarks_world.size());
  for (const Eigen::Vector3d& point : event.new_landmarks_world)
    told.new_landmarks_world.push_back(ToApi(point));
  Push(std::move(told));
}

void EventQueue::OnMap(const core::MapEvent& event) {
  {
    const std::scoped_lock lock(worlds_mutex_);
    worlds_.OnMap(event);
  }
  Push(MapEvent{static_cast<MapChange>(event.change), static_cast<int>(event.map.value),
                static_cast<int>(event.into.value)});
}

void EventQueue::Push(Event event) {
  {
    const std::scoped_lock lock(mutex_);
    events_.push_back({std::move(event), 0});
    DropBeyond(capacity_, IsPose);
    DropBeyond(kMostChanges, IsChange);
  }
  filled_.notify_one();
}

bool EventQueue::IsPose(const Event& event) {
  return std::holds_alternative<FrameEvent>(event) || std::holds_alternative<KeyframeEvent>(event);
}

void EventQueue::DropBeyond(size_t most, bool (*is_of_kind)(const Event&)) {
  const auto is_one = [=](const Waiting& waiting) { return is_of_kind(waiting.event); };
  if (static_cast<size_t>(std::ranges::count_if(events_, is_one)) <= most) return;
  const auto oldest = std::ranges::find_if(events_, is_one);
  const std::int64_t dropped = oldest->dropped_before + 1;
  events_.erase(oldest)->dropped_before += dropped;  // The newest is behind it.
}

void EventQueue::Deliver() {
  std::unique_lock lock(mutex_);
  while (true) {
    filled_.wait(lock, [this] { return closed_ || !events_.empty(); });
    if (events_.empty()) return;
    const Waiting next = std::move(events_.front());
    events_.pop_front();
    lock.unlock();
    Tell(next.event, next.dropped_before);
    lock.lock();
  }
}

void EventQueue::Tell(const Event& event, std::int64_t dropped) {
  if (is_broken_) return;
  try {
    if (dropped > 0) observer_->OnDropped(dropped);
    if (const auto* frame = std::get_if<FrameEvent>(&event)) observer_->OnFrame(*frame);
    if (const auto* keyframe = std::get_if<KeyframeEvent>(&event)) observer_->OnKeyframe(*keyframe);
    if (const auto* map = std::get_if<MapEvent>(&event)) observer_->OnMap(*map);
    if (std::holds_alternative<Restart>(event)) observer_->OnRestart();
  } catch (...) {
    is_broken_ = true;
    Log().warn("an observer threw and is told nothing more");
  }
}

Observer::Observer() = default;
Observer::~Observer() = default;
void Observer::OnFrame(const FrameEvent& /*event*/) {}
void Observer::OnKeyframe(const KeyframeEvent& /*event*/) {}
void Observer::OnMap(const MapEvent& /*event*/) {}
void Observer::OnRestart() {}
void Observer::OnDropped(std::int64_t /*dropped*/) {}

}  // namespace deepuav::api
