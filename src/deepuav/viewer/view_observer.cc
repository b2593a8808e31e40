#include "deepuav/viewer/view_observer.h"

#include <fmt/format.h>

#include <algorithm>

namespace deepuav {
namespace {

constexpr size_t kMostPathFrames = 4'000;
constexpr double kMapInterval = 1;  // Seconds between two copies of the map, at least.
constexpr int kMostWidth = 640;     // Of pictures that are worth a copy.

const char* StateName(const FrameRecord& record) {
  if (record.located()) return "tracked";
  return record.state == TrackingState::kInitialising ? "initialising" : "lost";
}

/// The largest of the halved images that is small enough.
const GreyImage& SmallImage(const ImagePyramid& pyramid) {
  int level = 0;
  while (level + 1 < pyramid.levels() && pyramid.level(level).cols > kMostWidth) ++level;
  return pyramid.level(level);
}

std::vector<Eigen::Vector2f> SeenInImage(const FrameRecord& record, const Camera& camera) {
  std::vector<Eigen::Vector2f> seen_px;
  seen_px.reserve(record.seen.size());
  for (const FrameRecord::Seen& seen : record.seen) {
    const Eigen::Vector3d ray = camera.pinhole.Unproject(seen.measured.px.cast<double>());
    if (const auto image_px = camera.Distort(ray)) seen_px.push_back(image_px->cast<float>());
  }
  return seen_px;
}

}  // namespace

void ViewObserver::OnFrame(const FrameRecord& record, const Frame& frame) {
  FrameView view;
  view.id = record.id;
  view.time = record.time;
  view.state = StateName(record);
  view.reason = record.reason;
  view.key_points = record.keypoint_count;
  view.landmarks = record.landmark_count;
  if (record.located()) {
    view.map = record.map.value;
    view.world_from_cam = record.cam_from_world.Inverse();
    AddToPath(record);
  }
  if (model_->IsWatched() && frame.image) {
    view.image = SmallImage(*frame.image);
    view.width_px = camera_.width;
    view.height_px = camera_.height;
    view.landmarks_px = SeenInImage(record, camera_);
  }
  model_->SetFrame(std::move(view));
}

void ViewObserver::AddToPath(const FrameRecord& record) {
  const std::scoped_lock lock(mutex_);
  if (record.id.value % every_ != 0) return;
  path_.push_back({record.id, record.pose});
  if (path_.size() <= kMostPathFrames) return;
  every_ *= 2;
  std::erase_if(path_, [this](const PathFrame& frame) { return frame.id.value % every_ != 0; });
}

std::vector<Eigen::Vector3f> ViewObserver::PathIn(const Map& map) {
  const std::scoped_lock lock(mutex_);
  std::vector<Eigen::Vector3f> path;
  path.reserve(path_.size());
  for (PathFrame& frame : path_) {
    const KeyframeId anchor = frame.pose.keyframe;
    if (!map.Contains(anchor) && !map.culled().contains(anchor)) continue;  // Of another map.
    frame.pose = map.OnRemaining(frame.pose);  // The map may forget those that were removed.
    path.push_back(map.PoseOf(frame.pose).Inverse().translation().cast<float>());
  }
  return path;
}

void ViewObserver::OnMap(const MapEvent& event) {
  switch (event.change) {
    case MapChange::kStarted:
      model_->AddEvent(fmt::format("map {} starts", event.map.value));
      break;
    case MapChange::kLoopClosed:
      ++closed_loops_;
      model_->AddEvent(fmt::format("a loop is closed in map {}", event.map.value));
      break;
    case MapChange::kMerged:
      ++merged_maps_;
      model_->AddEvent(
          fmt::format("map {} becomes part of map {}", event.map.value, event.into.value));
      break;
    case MapChange::kAdjusted:
      model_->AddEvent(fmt::format("map {} is adjusted as a whole", event.map.value));
      break;
  }
  changed_ = true;
  model_->CountChanges(closed_loops_, merged_maps_);
}

void ViewObserver::OnGauge(MapId map, int64_t /*revision*/, const Gauge& gauge) {
  const std::scoped_lock lock(mutex_);
  gauges_[map] = gauge.kind;
}

GaugeKind ViewObserver::GaugeOf(MapId map) {
  const std::scoped_lock lock(mutex_);
  const auto told = gauges_.find(map);
  return told == gauges_.end() ? GaugeKind::kFree : told->second;
}

void ViewObserver::OnMapState(const Map& map) {
  if (map_was_shown_ && !changed_ && since_map_.Seconds() < kMapInterval) return;
  map_was_shown_ = true;
  changed_ = false;
  since_map_.Restart();
  MapView view = ViewOf(map, GaugeOf(map.id()));
  view.path = PathIn(map);
  model_->SetMap(std::move(view));
}

void ViewObserver::OnRestart() {
  const std::scoped_lock lock(mutex_);
  gauges_.clear();
  path_.clear();
  every_ = 1;
  map_was_shown_ = changed_ = false;
  closed_loops_ = merged_maps_ = 0;
  model_->CountChanges(closed_loops_, merged_maps_);
  model_->AddEvent("the run begins anew, knowing its camera better");
}

}  // namespace deepuav
