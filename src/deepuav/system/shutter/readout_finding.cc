#include "deepuav/system/shutter/readout_finding.h"

#include <algorithm>

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
  const bool hears_turns = HearsTurns(imu_);
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
    const auto more = run_.Search(path_per_s, map, stop);
    if (!more || (!found && !counts(*more))) break;
    const double change_s = found ? SumOfRounds(found->change_s, more->change_s) : more->change_s;
    found = more;
    run_.camera->readout_s = std::clamp(run_.camera->readout_s + change_s, 0.0, search_.max_s);
    for (auto& [time, motion] : path_per_s.motions)
      motion = InReadout(motion, run_.camera->readout_s);
    run_.Take(path_per_s, map, records);
    run_.Adjust(map, stop);
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
  const CameraTurns turns(imu_, max_imu_gap_s_, reading);
  for (auto& [time, motion] : path.motions) {
    const auto measured = turns.DuringReadout(time);
    if (!measured) continue;
    motion = WithTurnOf(InReadout(*measured, 1 / reading.readout_s), motion);
  }
  return path;
}

}  // namespace deepuav
