#include "deepuav/system/lanes/mapping_lane.h"

#include <chrono>

namespace deepuav {

ThreadedLane::ThreadedLane(BackEnd* back_end)
    : back_end_(back_end), thread_([this] {
        while (const auto task = tasks_.Pop()) (*task)();
      }) {}

ThreadedLane::~ThreadedLane() {
  tasks_.Close();
  thread_.join();
}

template <typename Result>
std::future<Result> ThreadedLane::Enqueue(std::function<Result()> work) {
  auto task = std::make_shared<std::packaged_task<Result()>>(std::move(work));
  std::future<Result> result = task->get_future();
  tasks_.Push([task] { (*task)(); });
  return result;
}

LocalMapPtr ThreadedLane::StartMap(const InitialMapRequest& request) {
  return Enqueue<LocalMapPtr>([this, &request] { return back_end_->StartMap(request); }).get();
}

void ThreadedLane::Submit(KeyframeRequest request) {
  under_way_ = Enqueue<LocalMapPtr>([this, kept = std::move(request)] {
    if (failure_) std::rethrow_exception(failure_);
    return back_end_->InsertKeyframe(kept);
  });
  following_ = Follow([this] { back_end_->CloseLoops(); });
}

std::future<void> ThreadedLane::Follow(std::function<void()> work) {
  return Enqueue<void>([this, work = std::move(work)] {
    try {
      work();
    } catch (...) {
      failure_ = std::current_exception();
    }
  });
}

bool ThreadedLane::Ready() const {
  return under_way_.valid() &&
         under_way_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

void ThreadedLane::Settle() {
  if (following_.valid()) following_.get();
  if (failure_) std::rethrow_exception(failure_);
}

}  // namespace deepuav
