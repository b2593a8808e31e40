#pragma once

#include <future>
#include <memory>
#include <optional>
#include <thread>

#include "deepuav/base/queue.h"
#include "deepuav/mapping/mapper.h"

namespace deepuav {

using LocalMapPtr = std::shared_ptr<const LocalMap>;

/// Runs the Mapper: in place, or on a thread of its own. One keyframe is under way at most. Used
/// from one thread.
class MappingLane {
 public:
  virtual ~MappingLane() = default;
  /// Nothing may be under way.
  virtual LocalMapPtr StartMap(const InitialMapRequest& request) = 0;
  virtual void Submit(KeyframeRequest request) = 0;
  /// Whether Collect() would return at once.
  virtual bool Ready() const = 0;
  /// Waits for the submitted keyframe's local map. Throws what the Mapper threw.
  virtual LocalMapPtr Collect() = 0;
};

/// Maps in the calling thread.
class SequentialLane : public MappingLane {
 public:
  explicit SequentialLane(Mapper* mapper) : mapper_(mapper) {}
  LocalMapPtr StartMap(const InitialMapRequest& request) override {
    return mapper_->StartMap(request);
  }
  void Submit(KeyframeRequest request) override { local_map_ = mapper_->InsertKeyframe(request); }
  bool Ready() const override { return true; }
  LocalMapPtr Collect() override { return std::move(local_map_); }

 private:
  Mapper* mapper_;
  LocalMapPtr local_map_;
};

/// Maps on a thread of its own, which is the only one to touch the Mapper until the lane is gone.
class ThreadedLane : public MappingLane {
 public:
  explicit ThreadedLane(Mapper* mapper);
  ~ThreadedLane() override;
  LocalMapPtr StartMap(const InitialMapRequest& request) override;
  void Submit(KeyframeRequest request) override;
  bool Ready() const override;
  LocalMapPtr Collect() override { return under_way_.get(); }

 private:
  using Task = std::packaged_task<LocalMapPtr()>;

  Mapper* mapper_;
  BoundedQueue<Task> tasks_{1};
  std::future<LocalMapPtr> under_way_;
  std::thread thread_;
};

}  // namespace deepuav
