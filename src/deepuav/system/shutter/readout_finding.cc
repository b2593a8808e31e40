#include "deepuav/system/shutter/readout_finding.h"

#include <algorithm>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/inertial/camera_turns.h"
#include "deepuav/map/frame_motion.h"
#include "deepuav/system/shutter/readout_rounds.h"

namespace deepuav {
namespace {

/// Over which a gyroscope tells how images turn until something better is known.
constexpr double kTypicalReadoutS = 0.02;

}  // namespace

std::optional<FoundReadout> ReadoutFinding::FindIn(MapId map, const std::function<bool()>& stop,
                                                   std::vector<FrameRecord>* records) const {
  std::optional<FoundReadout> found;
  const bool is_known = run_.camera->readout_s > 0;
  const bool hears_turns = HearsTurns(run_.imu);
  if (hears_turns) found = FindBy(TurnsBy::kGyroscope, map, stop, records);
  // One that is known, and as known by turns that were measured, is right.
  const bool are_measured = hears_turns || HasMeasuredTurns(*run_.atlas, map, *records);
  if (!found && !(is_known && are_measured)) found = FindBy(TurnsBy::kPath, map, stop, records);
  if (found) {
    Log().info("the camera reads an image in {:.1f} ms, row by row (standard deviation {:.2f})",
               1000 * run_.camera->readout_s, 1000 * found->sigma_s);
  }
  return found;
}

std::optional<FoundReadout> ReadoutFinding::FindBy(TurnsBy source, MapId map,
                                                   const std::function<bool()>& stop,
                                                   std::vector<FrameRecord>* records) const {
  const bool is_known = run_.camera->readout_s > 0;
  const auto counts = [&](const FoundReadout& first) {
    return is_known ? IsOff(first, search_) : IsBelieved(first, search_);
  };
  std::optional<FoundReadout> found;
  for (int round = 0; round < options_.rounds && !stop(); ++round) {
    ReadoutPath path_per_s = PathPerS(source, map, *records);
    // Of turns of which it misses a part, too long a readout would make the whole.
    if (source == TurnsBy::kPath && !path_per_s.tells_turns) break;
    const auto more = run_.mapper->SearchReadout(
        map, MotionsOfKeyframes(path_per_s, run_.atlas->At(map), run_.first_new_keyframe), stop);
    if (!more || (!found && !counts(*more))) break;
    const double change_s = found ? SumOfRounds(found->change_s, more->change_s) : more->change_s;
    found = more;
    run_.camera->readout_s = std::clamp(run_.camera->readout_s + change_s, 0.0, search_.max_s);
    Take(run_.camera->readout_s, std::move(path_per_s), map, records);
    run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, false, stop);
  }
  return found;
}

ReadoutPath ReadoutFinding::PathPerS(TurnsBy source, MapId map,
                                     const std::vector<FrameRecord>& records) const {
  constexpr double kOneSecond = 1;
  ReadoutPath path =
      FindReadoutPath(*run_.atlas, map, records, pose_of_frame_, kOneSecond, options_);
  if (source == TurnsBy::kPath) return path;
  Camera reading = *run_.camera;
  if (reading.readout_s == 0) reading.readout_s = kTypicalReadoutS;
  const CameraTurns turns(run_.imu, run_.max_imu_gap_s, reading);
  for (auto& [time, motion] : path.motions) {
    const auto measured = turns.DuringReadout(time);
    if (!measured) continue;
    motion = WithTurnOf(InReadout(*measured, 1 / reading.readout_s), motion);
  }
  return path;
}

void ReadoutFinding::Take(double readout_s, ReadoutPath path_per_s, MapId map,
                          std::vector<FrameRecord>* records) const {
  for (auto& [time, motion] : path_per_s.motions) motion = InReadout(motion, readout_s);
  ChangeMotions(path_per_s, *run_.atlas, map, *run_.camera, records);
  run_.mapper->ChangeMotionsIn(
      map, MotionsOfKeyframes(path_per_s, run_.atlas->At(map), run_.first_new_keyframe));
}

}  // namespace deepuav
