#pragma once

#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <thread>

#include "deepuav/base/queue.h"
#include "deepuav/system/lanes/back_end.h"

namespace deepuav {

/// Runs the back end: in place, or on a thread of its own. One keyframe is under way at most; loops
/// may still be closed with earlier ones. Used from one thread.
class MappingLane {
 public:
  virtual ~MappingLane() = default;
  /// Nothing may be under way.
  virtual LocalMapPtr StartMap(const InitialMapRequest& request) = 0;
  virtual void Submit(KeyframeRequest request) = 0;
  /// Whether Collect() would return at once.
  virtual bool Ready() const = 0;
  /// Waits for the submitted keyframe's local map. Throws what the back end threw.
  virtual LocalMapPtr Collect() = 0;
  /// Waits until nothing is left to do: the atlas may be read then. Throws what the back end threw.
  virtual void Settle() = 0;
  /// Has `visit` called between two changes of the atlas, once the work at hand is done.
  virtual void Visit(std::function<void()> visit) = 0;
  /// The same where `change` changes the atlas: Settle() waits for it.
  virtual void Change(std::function<void()> change) = 0;
};

/// Maps in the calling thread.
class SequentialLane : public MappingLane {
 public:
  explicit SequentialLane(BackEnd* back_end) : back_end_(back_end) {}
  LocalMapPtr StartMap(const InitialMapRequest& request) override {
    return back_end_->StartMap(request);
  }
  void Submit(KeyframeRequest request) override {
    local_map_ = back_end_->InsertKeyframe(request);
    back_end_->CloseLoops();
  }
  bool Ready() const override { return true; }
  LocalMapPtr Collect() override { return std::move(local_map_); }
  void Settle() override {}
  void Visit(std::function<void()> visit) override { visit(); }
  void Change(std::function<void()> change) override { change(); }

 private:
  BackEnd* back_end_;
  LocalMapPtr local_map_;
};

/// Maps on a thread of its own, which is the only one to touch the atlas unless settled.
class ThreadedLane : public MappingLane {
 public:
  explicit ThreadedLane(BackEnd* back_end);
  ~ThreadedLane() override;
  LocalMapPtr StartMap(const InitialMapRequest& request) override;
  void Submit(KeyframeRequest request) override;
  bool Ready() const override;
  LocalMapPtr Collect() override { return under_way_.get(); }
  void Settle() override;
  void Visit(std::function<void()> visit) override { tasks_.Push(std::move(visit)); }
  void Change(std::function<void()> change) override { following_ = Follow(std::move(change)); }

 private:
  /// A keyframe's insertion and what follows it, a visit, two changes, and another's insertion
  /// behind them.
  static constexpr size_t kMostTasks = 6;

  template <typename Result>
  std::future<Result> Enqueue(std::function<Result()> work);
  /// What fails is told by what comes after it.
  std::future<void> Follow(std::function<void()> work);

  BackEnd* back_end_;
  BoundedQueue<std::function<void()>> tasks_{kMostTasks};
  std::future<LocalMapPtr> under_way_;
  std::future<void> following_;  ///< Of the newest that no one collects: Follow.
  std::exception_ptr failure_;   ///< Of these; touched by the thread, or once settled.
  std::thread thread_;
};

}  // namespace deepuav
