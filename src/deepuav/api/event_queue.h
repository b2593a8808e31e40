#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <variant>

#include "deepuav/api/observer.h"
#include "deepuav/system/sensors/known_worlds.h"
#include "deepuav/system/watching/run_observer.h"

namespace deepuav::api {

/// Copies what happens in a run and tells it to an observer on a thread of its own. Whoever tells
/// it waits for no one but another who does. What an observer cannot do without, changes of maps
/// and a run that begins anew, is not dropped for frames and keyframes that crowd in. Thread-safe.
class EventQueue : public ::deepuav::RunObserver {
 public:
  /// Changes of maps that wait at most. They are rare.
  static constexpr size_t kMostChanges = 1024;

  /// `observer` must outlive it. `capacity`: frames and keyframes that wait at most, beside
  /// kMostChanges changes and a beginning anew, of which a run has one; then the oldest of the same
  /// kind is dropped.
  EventQueue(Observer* observer, size_t capacity);
  /// Returns once those that wait were told.
  ~EventQueue() override;

  void OnFrame(const FrameRecord& record, const ::deepuav::Frame& frame) override;
  void OnKeyframe(::deepuav::KeyframeEvent event) override;
  void OnMap(const ::deepuav::MapEvent& event) override;
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override;
  void OnRestart() override;
  /// As KnownWorlds::Use: frames are told in metres from then on.
  void UseMetric(MapId map, int64_t revision, const MetricFromMap& metric);

 private:
  struct Restart {};
  using Event = std::variant<FrameEvent, KeyframeEvent, MapEvent, Restart>;
  struct Waiting {
    Event event;
    std::int64_t dropped_before = 0;  ///< Since the one before it.
  };

  static bool IsPose(const Event& event);
  static bool IsChange(const Event& event) { return std::holds_alternative<MapEvent>(event); }

  std::optional<MetricPose> MetricOf(const FrameRecord& record);
  void Push(Event event);
  void DropBeyond(size_t most, bool (*is_of_kind)(const Event&));
  void Deliver();
  void Tell(const Event& event, std::int64_t dropped);

  Observer* const observer_;
  const size_t capacity_;
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Waiting> events_;
  bool closed_ = false;
  std::mutex worlds_mutex_;
  KnownWorlds worlds_;
  bool is_broken_ = false;  ///< The observer threw. Of the thread alone.
  std::thread thread_;
};

}  // namespace deepuav::api
