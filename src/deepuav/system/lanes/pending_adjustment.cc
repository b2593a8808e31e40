#include "deepuav/system/lanes/pending_adjustment.h"

#include <chrono>

namespace deepuav {

PendingAdjustment::PendingAdjustment(GlobalAdjustment adjustment, bool on_own_thread,
                                     StageListener* stages, std::function<bool()> stop)
    : adjustment_(std::move(adjustment)) {
  const auto compute = [this, stages, stop = std::move(stop)] {
    const StageScope stage(stages, "global bundle adjustment");
    adjustment_.Compute([&] { return given_up_ || (stop && stop()); });
  };
  computed_ = std::async(std::launch::async, compute);
  if (!on_own_thread) computed_.wait();
}

PendingAdjustment::~PendingAdjustment() {
  given_up_ = true;
  if (computed_.valid()) computed_.wait();
}

bool PendingAdjustment::Ready() const {
  return !computed_.valid() ||
         computed_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const GlobalAdjustment& PendingAdjustment::Get() {
  if (computed_.valid()) computed_.get();
  return adjustment_;
}

}  // namespace deepuav
