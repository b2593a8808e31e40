#include "deepuav/system/photos/survey_telling.h"

namespace deepuav {
namespace {

constexpr double kSketchInterval = 1;  // Seconds, at least.

MapSketch SketchOf(MapId map, const SurveyState& state) {
  MapSketch sketch{map, {}, {}};
  for (const auto& pose : state.cam_from_world) {
    if (pose) sketch.cam_from_world.push_back(*pose);
  }
  for (const auto& point : state.points) {
    if (point) sketch.points_world.push_back(*point);
  }
  return sketch;
}

}  // namespace

void SurveyTelling::TellOfPhotograph(const Frame& frame) {
  if (!observer_) return;
  FrameRecord record;
  record.id = frame.id;
  record.time = frame.time;
  record.reason = "the maps are made once all photographs are read";
  record.keypoint_count = frame.features->size();
  observer_->OnFrame(record, frame);
}

void SurveyTelling::TellOfMaps(const Atlas& atlas) {
  if (!observer_) return;
  for (const MapId id : atlas.Remaining()) {
    const Map& map = atlas.At(id);
    observer_->OnMap({MapChange::kStarted, id, id});
    observer_->OnGauge(id, map.revision(), atlas.GaugeOf(id));
    map.keyframes().ForEach(
        [&](const Keyframe& keyframe) { observer_->OnKeyframe(EventOf(keyframe, map)); });
    observer_->OnMapState(map);
  }
}

void SurveyTelling::OnWork(const char* what, int done, int total) {
  if (work_) work_(what, done, total);
}

void SurveyTelling::OnGrowth(MapId map, const SurveyState& state) {
  if (!observer_ || (was_sketched_ && since_sketch_.Seconds() < kSketchInterval)) return;
  was_sketched_ = true;
  since_sketch_.Restart();
  observer_->OnSketch(SketchOf(map, state));
}

}  // namespace deepuav
