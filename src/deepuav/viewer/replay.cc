#include "deepuav/viewer/replay.h"

#include <fmt/format.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/base/wait.h"
#include "deepuav/evaluation/report/run_folder.h"
#include "deepuav/viewer/map_view.h"

namespace deepuav {
namespace {

constexpr double kMapInterval = 0.5;

int64_t MainMapOf(const RunFolder& run) {
  const std::string main_map = run.Text("/main_map");
  return main_map.empty() ? -1 : std::stoll(main_map);
}

int Count(const RunFolder& run, const char* key) {
  const auto count = run.summary.find(key);
  return count != run.summary.end() && count->is_number_integer() ? count->get<int>() : 0;
}

}  // namespace

Replay::Replay(const std::filesystem::path& folder, const ReplayOptions& options, ViewModel* model)
    : options_(options),
      model_(model),
      loaded_(ReadMapFile(folder / "map.deepuav")),
      maps_(loaded_.atlas.Remaining()) {
  const RunFolder run = ReadRunFolder(folder);
  frames_ = ReadRecordedFrames(folder, MainMapOf(run));
  for (const auto& [stage, ms] : run.stage_ms) {
    if (!ms.empty()) model_->AddStage(stage, 1e-3 * Median(ms));
  }
  // When it closed its loops is not recorded, only how many.
  model_->CountChanges(Count(run, "closed_loops"), Count(run, "merged_maps"));
  model_->SetPeakMemory(run.summary.value("peak_resident_mb", 0.));
  if (frames_.empty()) throw Error("{}: holds no frame to show", (folder / "frames.csv").string());
}

void Replay::Run(const std::function<bool()>& stop) {
  while (!stop()) {
    path_.clear();
    path_map_ = -1;
    newest_ = {-1};
    model_->AddEvent("the replay begins");
    Timestamp last = frames_.front().time;
    for (const RecordedFrame& frame : frames_) {
      WaitUnless(stop,
                 std::min(SecondsBetween(last, frame.time) / options_.speed, options_.most_gap_s));
      if (stop()) return;
      last = frame.time;
      ShowFrame(frame);
    }
    ShowMap(frames_.back());
    model_->AddEvent("the replay ends");
    WaitUnless(stop, options_.pause_s);
  }
}

void Replay::ShowFrame(const RecordedFrame& frame) {
  FrameView view;
  view.id = frame.id;
  view.time = frame.time;
  view.state = frame.state;
  view.reason = frame.reason;
  view.map = frame.map;
  view.key_points = frame.key_points;
  view.landmarks = frame.landmarks;
  view.world_from_cam = frame.world_from_cam;
  AddPicture(frame, &view);
  model_->SetFrame(std::move(view));
  const bool is_other_map = frame.map >= 0 && frame.map != path_map_;
  if (is_other_map) {
    path_.clear();
    path_map_ = frame.map;
  }
  if (frame.world_from_cam) path_.push_back(frame.world_from_cam->translation().cast<float>());
  if (frame.keyframe.valid()) newest_ = std::max(newest_, frame.keyframe);
  if (is_other_map || since_map_.Seconds() >= kMapInterval) ShowMap(frame);
}

void Replay::ShowMap(const RecordedFrame& frame) {
  if (path_map_ < 0 || static_cast<size_t>(path_map_) >= maps_.size()) return;
  since_map_.Restart();
  const MapId map = maps_[static_cast<size_t>(path_map_)];
  MapView view = ViewOf(loaded_.atlas.At(map), loaded_.atlas.GaugeOf(map).kind, newest_);
  view.map = frame.map >= 0 ? frame.map : path_map_;
  view.path = path_;
  model_->SetMap(std::move(view));
}

void Replay::AddPicture(const RecordedFrame& recorded, FrameView* view) const {
  if (!recorded.keyframe.valid() || recorded.map < 0 ||
      static_cast<size_t>(recorded.map) >= maps_.size())
    return;
  const Map& map = loaded_.atlas.At(maps_[static_cast<size_t>(recorded.map)]);
  const Keyframe* keyframe = map.keyframes().Find(recorded.keyframe);
  if (!keyframe || !keyframe->frame.image) return;
  view->image = keyframe->frame.image->image();
  view->width_px = loaded_.camera.width;
  view->height_px = loaded_.camera.height;
  for (size_t i = 0; i < keyframe->landmarks.size(); ++i) {
    if (keyframe->landmarks[i].valid())
      view->landmarks_px.push_back(keyframe->features().keypoints[i].image_px);
  }
}

}  // namespace deepuav
