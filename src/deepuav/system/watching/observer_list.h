#pragma once

#include <string>
#include <utility>
#include <vector>

#include "deepuav/system/watching/run_observer.h"

namespace deepuav {

/// Tells several observers, in the order in which they were added.
class ObserverList : public RunObserver {
 public:
  /// `observer` must outlive the run; added before it begins.
  void Add(RunObserver* observer) { observers_.push_back(observer); }
  bool empty() const { return observers_.empty(); }

  void OnFrame(const FrameRecord& record, const Frame& frame) override {
    for (RunObserver* observer : observers_) observer->OnFrame(record, frame);
  }
  void OnKeyframe(KeyframeEvent event) override {
    for (RunObserver* observer : observers_) observer->OnKeyframe(event);
  }
  void OnMap(const MapEvent& event) override {
    for (RunObserver* observer : observers_) observer->OnMap(event);
  }
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override {
    for (RunObserver* observer : observers_) observer->OnGauge(map, revision, gauge);
  }
  void OnSketch(const MapSketch& sketch) override {
    for (RunObserver* observer : observers_) observer->OnSketch(sketch);
  }
  void OnMapState(const Map& map) override {
    for (RunObserver* observer : observers_) observer->OnMapState(map);
  }
  void OnRestart() override {
    for (RunObserver* observer : observers_) observer->OnRestart();
  }
  void OnStage(const std::string& stage, double seconds) override {
    for (RunObserver* observer : observers_) observer->OnStage(stage, seconds);
  }

 private:
  std::vector<RunObserver*> observers_;
};

}  // namespace deepuav
