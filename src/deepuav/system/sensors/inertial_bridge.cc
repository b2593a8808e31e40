#include "deepuav/system/sensors/inertial_bridge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;

/// That of the map whose path tells it best.
double ClockOffset(const std::map<MapId, InertialAttempt>& attempts) {
  double offset_s = 0, least_sigma_s = std::numeric_limits<double>::infinity();
  for (const auto& [map, attempt] : attempts) {
    if (!attempt.found || attempt.found->clock_sigma_s >= least_sigma_s) continue;
    offset_s = attempt.found->clock_offset_s;
    least_sigma_s = attempt.found->clock_sigma_s;
  }
  return offset_s;
}

MotionState Moved(const Sim3& new_from_old, const MotionState& motion) {
  MotionState moved = motion;
  moved.world_from_imu = {new_from_old.rotation() * motion.world_from_imu.rotation(),
                          new_from_old * motion.world_from_imu.translation()};
  moved.velocity_m_s = new_from_old.rotation() * motion.velocity_m_s;
  return moved;
}

/// Between two, at this share of the way from the first to the last.
SE3 Between(const SE3& first, const SE3& last, double share) {
  return {first.rotation().slerp(share, last.rotation()),
          (1 - share) * first.translation() + share * last.translation()};
}

/// As stated, or as a map told it.
SE3 MountOf(const ImuStream& imu, const std::map<MapId, InertialAttempt>& attempts) {
  if (imu.mount_is_known) return imu.cam_from_imu;
  for (const auto& [map, attempt] : attempts) {
    if (attempt.found) return attempt.found->cam_from_imu;
  }
  return imu.cam_from_imu;
}

}  // namespace

InertialBridge::InertialBridge(const ImuStream& imu, const InertialOptions& options,
                               PoseOfFrame pose_of_frame,
                               const std::map<MapId, InertialAttempt>& attempts, Mapper* mapper,
                               Atlas* atlas)
    : cam_from_imu_(MountOf(imu, attempts)),
      options_(options),
      pose_of_frame_(std::move(pose_of_frame)),
      mapper_(mapper),
      atlas_(atlas),
      integrator_(CleanSamples(imu.samples), NoiseOf(imu, options), options.max_imu_gap_s),
      reckoning_(integrator_, ClockOffset(attempts), options.gravity_m_s2) {
  for (const auto& [map, attempt] : attempts) {
    if (attempt.found) motions_[map] = attempt.found->motions;
  }
}

int InertialBridge::JoinMaps(const std::vector<FrameRecord>& records) {
  int joined = 0;
  // Each join may make the next gap's map known.
  for (bool changed = true; changed;) {
    changed = false;
    for (const Gap& gap : GapsOf(records)) {
      if (atlas_->Current(records[gap.before].map) == atlas_->Current(records[gap.after].map))
        continue;
      if (!Join(records, gap)) continue;
      changed = true;
      ++joined;
    }
  }
  return joined;
}

std::vector<InertialBridge::Gap> InertialBridge::GapsOf(
    const std::vector<FrameRecord>& records) const {
  std::vector<Gap> gaps;
  std::optional<size_t> before;
  for (size_t i = 0; i < records.size(); ++i) {
    if (!records[i].located()) continue;
    const bool is_gap = before && (*before + 1 < i || atlas_->Current(records[*before].map) !=
                                                          atlas_->Current(records[i].map));
    if (is_gap && SecondsBetween(records[*before].time, records[i].time) <= options_.max_blind_s)
      gaps.push_back({*before, i});
    before = i;
  }
  return gaps;
}

std::optional<MotionState> InertialBridge::MotionNear(MapId map, Timestamp time) const {
  const auto found = motions_.find(atlas_->Current(map));
  if (found == motions_.end()) return std::nullopt;
  const MotionState* nearest = nullptr;
  double least_s = options_.max_path_gap_s;
  for (const MotionState& motion : found->second) {
    const double apart_s = std::abs(SecondsBetween(motion.time, time));
    if (apart_s > least_s) continue;
    nearest = &motion;
    least_s = apart_s;
  }
  return nearest ? std::optional(*nearest) : std::nullopt;
}

bool InertialBridge::Join(const std::vector<FrameRecord>& records, const Gap& gap) {
  const MapId before = atlas_->Current(records[gap.before].map);
  const MapId after = atlas_->Current(records[gap.after].map);
  const auto is_placed = [this](MapId map) {
    return atlas_->GaugeOf(map).kind == GaugeKind::kGeoreferenced;
  };
  if (is_placed(before) || is_placed(after) || refused_.contains({before, after})) return false;
  const std::optional<MotionState> from = MotionNear(before, records[gap.before].time);
  const std::optional<MotionState> to = MotionNear(after, records[gap.after].time);
  if (!from && !to) return false;
  const bool before_is_known = from.has_value();
  const MapId known = before_is_known ? before : after, other = before_is_known ? after : before;
  const LinkAttempt link =
      from && to ? LinkMotions(*from, *to, reckoning_, options_)
                 : LinkPath(from ? *from : *to, PathIn(*atlas_, other, records, pose_of_frame_),
                            cam_from_imu_, reckoning_, options_);
  if (!link.world_from_path) {
    Log().info("maps {} and {} stay two in spite of the IMU: {}", before.value, after.value,
               link.reason);
    refused_.insert({before, after});
    return false;
  }
  Log().info("maps {} and {} are one by the IMU, over {:.1f} s", before.value, after.value,
             SecondsBetween(records[gap.before].time, records[gap.after].time));
  const KeyframeId last = atlas_->At(before).Remaining(records[gap.before].pose.keyframe);
  const KeyframeId first = atlas_->At(after).Remaining(records[gap.after].pose.keyframe);
  MoveTo(known, other, *link.world_from_path);
  if (!from || !to) CarryAlong(from ? *from : *to, other, records);
  mapper_->Join({after, before, Sim3(), {}, {{first, last, {}}}});
  TakeMotions(before, after);
  return true;
}

void InertialBridge::MoveTo(MapId known, MapId other, const Sim3& known_from_other) {
  mapper_->ChangeGauge(other, known_from_other, atlas_->GaugeOf(known));
  const auto motions = motions_.find(other);
  if (motions == motions_.end()) return;
  for (MotionState& motion : motions->second) motion = Moved(known_from_other, motion);
}

void InertialBridge::CarryAlong(const MotionState& known, MapId other,
                                const std::vector<FrameRecord>& records) {
  Trajectory path = PathIn(*atlas_, other, records, pose_of_frame_);
  if (path.front().time < known.time) std::reverse(path.begin(), path.end());
  MotionState at = known;
  for (const TimedPose& pose : path) {
    const std::optional<MotionState> next = reckoning_.At(pose.time, at);
    if (!next) break;
    at = *next;
    at.world_from_imu = pose.world_from_cam * cam_from_imu_;
    motions_[other].push_back(at);
  }
}

void InertialBridge::TakeMotions(MapId before, MapId after) {
  std::vector<MotionState> all;
  for (const MapId map : {before, after}) {
    const auto motions = motions_.find(map);
    if (motions == motions_.end()) continue;
    all.insert(all.end(), motions->second.begin(), motions->second.end());
    motions_.erase(motions);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const MotionState& a, const MotionState& b) { return a.time < b.time; });
  motions_[atlas_->Current(before)] = std::move(all);
}

std::vector<ReckonedFrame> InertialBridge::Reckon(const std::vector<FrameRecord>& records) const {
  std::vector<ReckonedFrame> frames;
  for (const Gap& gap : GapsOf(records)) {
    const MapId map = atlas_->Current(records[gap.before].map);
    if (map == atlas_->Current(records[gap.after].map)) ReckonBetween(records, gap, &frames);
  }
  return frames;
}

void InertialBridge::ReckonBetween(const std::vector<FrameRecord>& records, const Gap& gap,
                                   std::vector<ReckonedFrame>* frames) const {
  const FrameRecord &first = records[gap.before], &last = records[gap.after];
  const Map& map = atlas_->At(first.map);
  const std::optional<MotionState> from = MotionNear(map.id(), first.time);
  const std::optional<MotionState> to = MotionNear(map.id(), last.time);
  if (!from || !to) return;
  const double gap_s = SecondsBetween(first.time, last.time);
  std::vector<ReckonedFrame> between;
  for (size_t i = gap.before + 1; i < gap.after; ++i) {
    const auto onwards = reckoning_.At(records[i].time, *from);
    const auto back = reckoning_.At(records[i].time, *to);
    if (!onwards || !back) return;
    const SE3 miss = onwards->world_from_imu.Inverse() * back->world_from_imu;
    if (miss.translation().norm() > gap_s * options_.max_blind_misfit_m_s ||
        RotationLog(miss.rotation()).norm() > kDegree * options_.max_blind_turn_deg)
      return;
    const double share = SecondsBetween(first.time, records[i].time) / gap_s;
    const SE3 cam_from_world =
        cam_from_imu_ * Between(onwards->world_from_imu, back->world_from_imu, share).Inverse();
    const Keyframe& keyframe = map.At(map.Remaining(first.pose.keyframe));
    between.push_back(
        {i,
         map.id(),
         {keyframe.id, cam_from_world * keyframe.cam_from_world.Inverse(), keyframe.scale}});
  }
  frames->insert(frames->end(), between.begin(), between.end());
}

void TakeReckoned(const Atlas& atlas, const std::vector<ReckonedFrame>& frames,
                  std::vector<FrameRecord>* records) {
  for (const ReckonedFrame& frame : frames) {
    FrameRecord& record = (*records)[frame.record];
    if (record.located()) continue;
    record.map = frame.map;
    record.pose = frame.pose;
    record.reckoned = true;
    record.cam_from_world = atlas.At(frame.map).PoseOf(frame.pose);
  }
}

}  // namespace deepuav
