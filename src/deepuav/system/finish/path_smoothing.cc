#include "deepuav/system/finish/path_smoothing.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <span>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr int kMinPaceChanges = 5;

double MedianStepS(const std::vector<FrameRecord>& records) {
  std::vector<double> steps_s;
  for (size_t i = 0; i + 1 < records.size(); ++i)
    steps_s.push_back(SecondsBetween(records[i].time, records[i + 1].time));
  return steps_s.empty() ? 0 : Median(steps_s);
}

/// How the camera moves about each frame; not usable where nothing tells it.
std::vector<MotionNoise> MotionAlong(const std::vector<FrameRecord*>& stretch,
                                     const PathSmoothingOptions& options) {
  Trajectory firm;
  std::vector<double> steps_s;
  for (const FrameRecord* record : stretch) {
    if (record->landmark_count >= options.firm_landmarks)
      firm.push_back({record->time, record->cam_from_world.Inverse()});
  }
  for (size_t i = 0; i + 1 < stretch.size(); ++i)
    steps_s.push_back(SecondsBetween(stretch[i]->time, stretch[i + 1]->time));
  const double max_step_s = 1.5 * Median(steps_s);
  const MotionNoise of_all = MeasureMotionNoise(firm, max_step_s, kMinPaceChanges);
  std::vector<MotionNoise> noises;
  size_t first = 0, last = 0;
  for (const FrameRecord* record : stretch) {
    const auto is_past = [&](const TimedPose& pose, double seconds) {
      return SecondsBetween(record->time, pose.time) > seconds;
    };
    while (first < firm.size() && !is_past(firm[first], -options.motion_window_s)) ++first;
    while (last < firm.size() && !is_past(firm[last], options.motion_window_s)) ++last;
    const auto near = std::span(firm).subspan(first, std::max(last, first) - first);
    const MotionNoise noise = MeasureMotionNoise(near, max_step_s, kMinPaceChanges);
    noises.push_back(noise.usable() ? noise : of_all);
  }
  return noises;
}

}  // namespace

void PathSmoothingOptions::Check() const { CheckOptions("smoothing", *this); }

PathSmoothing::PathSmoothing(const PathSmoothingOptions& options, const Atlas& atlas)
    : options_(options), atlas_(atlas) {
  options_.Check();
}

void PathSmoothing::Smooth(std::vector<FrameRecord>* records) const {
  if (!options_.path.enabled) return;
  for (const Stretch& stretch : Stretches(records)) SmoothStretch(stretch);
}

std::vector<PathSmoothing::Stretch> PathSmoothing::Stretches(
    std::vector<FrameRecord>* records) const {
  const double max_step_s = options_.max_step * MedianStepS(*records);
  std::vector<Stretch> stretches;
  const FrameRecord* before = nullptr;
  for (FrameRecord& record : *records) {
    if (!record.located() || record.reckoned || record.inferred) continue;
    const bool goes_on = before && before->map == record.map && record.time > before->time &&
                         SecondsBetween(before->time, record.time) <= max_step_s;
    if (!goes_on) stretches.emplace_back();
    stretches.back().push_back(&record);
    before = &record;
  }
  return stretches;
}

void PathSmoothing::SmoothStretch(const Stretch& stretch) const {
  if (stretch.size() < 3) return;
  const std::vector<MotionNoise> motion = MotionAlong(stretch, options_);
  std::vector<PathPose> path;
  for (size_t i = 0; i < stretch.size(); ++i) {
    path.push_back(PoseOf(*stretch[i], stretch.front()->time));
    path.back().to_next = motion[i];
  }
  const auto smooth = SmoothPath(path, options_.path);
  if (!smooth) return;
  for (size_t i = 0; i < stretch.size(); ++i) {
    if (!path[i].is_known) stretch[i]->cam_from_world = (*smooth)[i];
  }
}

PathPose PathSmoothing::PoseOf(const FrameRecord& record, Timestamp start) const {
  PathPose pose;
  pose.time_s = SecondsBetween(start, record.time);
  pose.cam_from_world = record.cam_from_world;
  const Map& map = atlas_.At(atlas_.Current(record.map));
  const double growth =
      map.At(map.Remaining(record.pose.keyframe)).scale / record.pose.keyframe_scale;
  pose.information = record.pose_information;
  pose.information.topRows<3>() /= growth;
  pose.information.leftCols<3>() /= growth;
  const bool is_known_how_well =
      pose.information.allFinite() && pose.information.llt().info() == Eigen::Success;
  pose.is_known = IsKeyframe(record) || !is_known_how_well;
  return pose;
}

bool PathSmoothing::IsKeyframe(const FrameRecord& record) const {
  const Map& map = atlas_.At(atlas_.Current(record.map));
  return map.At(map.Remaining(record.pose.keyframe)).frame.id == record.id;
}

}  // namespace deepuav
