#include "deepuav/system/shutter/readout_path.h"

#include <algorithm>
#include <memory>

#include "deepuav/base/option_check.h"
#include "deepuav/features/readout_correction.h"
#include "deepuav/map/frame_motion.h"

namespace deepuav {
namespace {

ReadoutMotion WithoutTurn(ReadoutMotion motion) {
  motion.turn_rad.setZero();
  motion.bend_rad.setZero();
  return motion;
}

/// `motion` in the map's units.
void ChangeMotion(ReadoutMotion motion, const Map& map, const Camera& camera, FrameRecord* record) {
  const double grown = map.GrowthSince(record->pose);
  ReadoutMotion known = record->seen_motion;
  known.travel *= grown;
  const SE3 cam_from_world = map.PoseOf(record->pose);
  for (FrameRecord::Seen& seen : record->seen) {
    const auto landmark = map.Current(seen.landmark);
    if (!landmark) continue;
    const double depth = (cam_from_world * map.At(*landmark).position_world).z();
    if (!(depth > 0)) continue;
    const auto moved =
        ForOtherMotion(camera, seen.measured.px.cast<double>(), known, motion, 1 / depth);
    if (moved) seen.measured.px = moved->cast<float>();
  }
  motion.travel /= grown;
  record->seen_motion = motion;
  if (!record->features) return;
  if (!motion.TurnsAs(record->motion)) {
    record->features = std::make_shared<const Features>(
        CorrectedForTurn(*record->features, record->motion, motion, camera));
  }
  record->motion = motion;
}

}  // namespace

void ReadoutPathOptions::Check() const { CheckOptions("readout", *this); }

ReadoutPath FindReadoutPath(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                            const PoseOfFrame& pose_of_frame, double readout_s,
                            const ReadoutPathOptions& options) {
  const Trajectory path = PathIn(atlas, map, records, pose_of_frame);
  const auto missed = TurnsMissed(path, options.path);
  ReadoutPath found;
  found.tells_turns = !missed || missed->share() <= options.max_missed ||
                      missed->missed_rad <= options.harmless_rad;
  for (size_t i = 0; i < path.size(); ++i) {
    const auto motion = MotionOnPath(path, i, readout_s, options.path);
    if (motion) found.motions[path[i].time] = found.tells_turns ? *motion : WithoutTurn(*motion);
  }
  return found;
}

bool HasMeasuredTurns(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records) {
  return std::ranges::any_of(records, [&](const FrameRecord& record) {
    return record.located() && record.turn_is_measured &&
           atlas.Current(record.map) == atlas.Current(map);
  });
}

void KeepMeasuredTurns(const std::vector<FrameRecord>& records, ReadoutPath* path) {
  for (const FrameRecord& record : records) {
    const auto motion = path->motions.find(record.time);
    if (record.turn_is_measured && motion != path->motions.end())
      motion->second = WithTurnOf(record.seen_motion, motion->second);
  }
}

std::map<KeyframeId, ReadoutMotion> MotionsOfKeyframes(const ReadoutPath& path, const Map& map,
                                                       KeyframeId first) {
  std::map<KeyframeId, ReadoutMotion> motions;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    const auto found = path.motions.find(keyframe.frame.time);
    if (keyframe.id >= first && found != path.motions.end()) motions[keyframe.id] = found->second;
  });
  return motions;
}

void ChangeMotions(const ReadoutPath& path, const Atlas& atlas, MapId map, const Camera& camera,
                   std::vector<FrameRecord>* records) {
  for (FrameRecord& record : *records) {
    if (!record.located() || atlas.Current(record.map) != atlas.Current(map)) continue;
    const auto found = path.motions.find(record.time);
    if (found != path.motions.end()) ChangeMotion(found->second, atlas.At(map), camera, &record);
  }
}

}  // namespace deepuav
