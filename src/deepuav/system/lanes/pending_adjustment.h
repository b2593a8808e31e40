#pragma once

#include <atomic>
#include <functional>
#include <future>

#include "deepuav/base/stages.h"
#include "deepuav/mapping/adjustment/global_adjustment.h"

namespace deepuav {

/// A global adjustment that is being computed: at once, or on a thread of its own.
class PendingAdjustment {
 public:
  /// `stages` (may be null) must outlive it. `stop` (may be empty) is asked between the steps, in
  /// the thread that computes; what is reached by then is the result.
  PendingAdjustment(GlobalAdjustment adjustment, bool on_own_thread, StageListener* stages,
                    std::function<bool()> stop = nullptr);
  /// Gives up what is not finished.
  ~PendingAdjustment();

  MapId map() const { return adjustment_.map(); }
  bool Ready() const;
  /// Waits for the result. Throws what the computation threw.
  const GlobalAdjustment& Get();

  int keyframes_since = 0;  ///< Inserted since it was begun.

 private:
  GlobalAdjustment adjustment_;
  std::atomic<bool> given_up_{false};
  std::future<void> computed_;
};

}  // namespace deepuav
