#pragma once

#include <atomic>
#include <future>

#include "deepuav/base/stages.h"
#include "deepuav/mapping/global_adjustment.h"

namespace deepuav {

/// A global adjustment that is being computed: at once, or on a thread of its own.
class PendingAdjustment {
 public:
  /// `stages` (may be null) must outlive it.
  PendingAdjustment(GlobalAdjustment adjustment, bool on_own_thread, StageListener* stages);
  /// Gives up what is not finished.
  ~PendingAdjustment();

  MapId map() const { return adjustment_.map(); }
  bool Ready() const;
  /// Waits for the result. Throws what the computation threw.
  const GlobalAdjustment& Get();

  int keyframes_since = 0;  ///< Inserted since it was begun.

 private:
  GlobalAdjustment adjustment_;
  std::atomic<bool> stop_{false};
  std::future<void> computed_;
};

}  // namespace deepuav
