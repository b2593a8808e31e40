#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>
#include <variant>

#include "deepuav/api/observer.h"
#include "deepuav/system/run_observer.h"

namespace deepuav::api {

/// Copies what happens in a run and tells it to an observer on a thread of its own. Whoever tells
/// it waits for no one but another who does. Thread-safe.
class EventQueue : public ::deepuav::RunObserver {
 public:
  /// `observer` must outlive it. `capacity`: events that wait at most; then the oldest is dropped.
  EventQueue(Observer* observer, size_t capacity);
  /// Returns once those that wait were told.
  ~EventQueue() override;

  void OnFrame(const FrameRecord& record, const ::deepuav::Frame& frame) override;
  void OnKeyframe(::deepuav::KeyframeEvent event) override;
  void OnMap(const ::deepuav::MapEvent& event) override;
  void OnRestart() override { Push(Restart{}); }

 private:
  struct Restart {};
  using Event = std::variant<FrameEvent, KeyframeEvent, MapEvent, Restart>;

  void Push(Event event);
  void Deliver();
  void Tell(const Event& event, std::int64_t dropped);

  Observer* const observer_;
  const size_t capacity_;
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<Event> events_;
  std::int64_t dropped_ = 0;  ///< Since the last one delivered.
  bool closed_ = false;
  bool is_broken_ = false;  ///< The observer threw. Of the thread alone.
  std::thread thread_;
};

}  // namespace deepuav::api
