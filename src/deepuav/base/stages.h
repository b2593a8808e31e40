#pragma once

namespace deepuav {

/// Hears when a stage of the work begins and ends. The parts that must hold no clock report to one;
/// `system` measures.
class StageListener {
 public:
  virtual ~StageListener() = default;
  /// `stage` is a literal.
  virtual void Begin(const char* stage) = 0;
  virtual void End(const char* stage) = 0;
};

/// Reports a stage for as long as it lives; `listener` may be null.
class StageScope {
 public:
  StageScope(StageListener* listener, const char* stage) : listener_(listener), stage_(stage) {
    if (listener_) listener_->Begin(stage_);
  }
  ~StageScope() {
    if (listener_) listener_->End(stage_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageListener* listener_;
  const char* stage_;
};

}  // namespace deepuav
