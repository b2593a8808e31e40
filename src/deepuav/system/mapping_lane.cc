#include "deepuav/system/mapping_lane.h"

#include <chrono>

namespace deepuav {

ThreadedLane::ThreadedLane(Mapper* mapper)
    : mapper_(mapper), thread_([this] {
        while (std::optional<Task> task = tasks_.Pop()) (*task)();
      }) {}

ThreadedLane::~ThreadedLane() {
  tasks_.Close();
  thread_.join();
}

LocalMapPtr ThreadedLane::StartMap(const InitialMapRequest& request) {
  Task task([this, &request] { return mapper_->StartMap(request); });
  std::future<LocalMapPtr> started = task.get_future();
  tasks_.Push(std::move(task));
  return started.get();
}

void ThreadedLane::Submit(KeyframeRequest request) {
  Task task([this, kept = std::move(request)] { return mapper_->InsertKeyframe(kept); });
  under_way_ = task.get_future();
  tasks_.Push(std::move(task));
}

bool ThreadedLane::Ready() const {
  return under_way_.valid() &&
         under_way_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

}  // namespace deepuav
