#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <mutex>

#include "deepuav/geometry/camera.h"
#include "deepuav/system/watching/run_observer.h"
#include "deepuav/viewer/map_view.h"
#include "deepuav/viewer/view_model.h"

namespace deepuav {

/// Tells a model what happens in a run.
class ViewObserver : public RunObserver {
 public:
  /// `model` must outlive it. `camera`: of the images as the run works on them.
  ViewObserver(const Camera& camera, ViewModel* model) : camera_(camera), model_(model) {}

  void OnFrame(const FrameRecord& record, const Frame& frame) override;
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& event) override;
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override;
  void OnSketch(const MapSketch& sketch) override { model_->SetMap(ViewOf(sketch)); }
  void OnMapState(const Map& map) override;
  void OnRestart() override;
  void OnStage(const std::string& stage, double seconds) override {
    model_->AddStage(stage, seconds);
  }

 private:
  /// A frame of the path, which moves with the map.
  struct PathFrame {
    FrameId id;
    AnchoredPose pose;
  };

  void AddToPath(const FrameRecord& record);
  std::vector<Eigen::Vector3f> PathIn(const Map& map);
  GaugeKind GaugeOf(MapId map);

  const Camera camera_;
  ViewModel* const model_;
  std::mutex mutex_;
  std::map<MapId, GaugeKind> gauges_;  ///< Of maps whose gauge was told.
  std::deque<PathFrame> path_;
  int64_t every_ = 1;  ///< Which frames are on the path: every so many-th.
  // Of the mapping's thread alone.
  Stopwatch since_map_;
  bool map_was_shown_ = false, changed_ = false;
  int closed_loops_ = 0, merged_maps_ = 0;
};

}  // namespace deepuav
