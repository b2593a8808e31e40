#include "deepuav/system/readout_finding.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "deepuav/base/logging.h"

namespace deepuav {
namespace {

/// What contradicts a shutter that reads all rows at once was taken for outliers while the map was
/// made, and bends its path: so each round finds but a part of what is left, and what all rounds to
/// come would find is the sum of a geometric series (Aitken's process).
double Extrapolated(double last_s, double now_s) {
  constexpr double kMaxRatio = 0.75;
  const double ratio = last_s > 0 ? std::clamp(now_s / last_s, 0.0, kMaxRatio) : 0;
  return now_s / (1 - ratio);
}

}  // namespace

std::optional<FoundReadout> ReadoutFinding::FindIn(MapId map, const std::function<bool()>& stop,
                                                   std::vector<FrameRecord>* records) const {
  // Turns that the path only seems to tell fit no readout.
  ReadoutPathOptions with_all_turns = options_;
  with_all_turns.max_missed = std::numeric_limits<double>::infinity();
  std::optional<FoundReadout> found;
  for (int round = 0; round < options_.rounds && !stop(); ++round) {
    constexpr double kOneSecond = 1;
    ReadoutPath path_per_s =
        FindReadoutPath(*run_.atlas, map, *records, pose_of_frame_, kOneSecond, with_all_turns);
    const auto more = run_.mapper->SearchReadout(
        map, MotionsOfKeyframes(path_per_s, run_.atlas->At(map), run_.first_new_keyframe), stop);
    if (!more || (!found && !IsBelieved(*more, search_))) break;
    const double change_s = found ? Extrapolated(found->change_s, more->change_s) : more->change_s;
    found = more;
    run_.camera->readout_s = std::clamp(run_.camera->readout_s + change_s, 0.0, search_.max_s);
    Take(run_.camera->readout_s, std::move(path_per_s), map, records);
    run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, false, stop);
  }
  if (found) {
    Log().info("the camera reads an image in {:.1f} ms, row by row (standard deviation {:.2f})",
               1000 * run_.camera->readout_s, 1000 * found->sigma_s);
  }
  return found;
}

void ReadoutFinding::Take(double readout_s, ReadoutPath path_per_s, MapId map,
                          std::vector<FrameRecord>* records) const {
  for (auto& [time, motion] : path_per_s.motions) motion = InReadout(motion, readout_s);
  ChangeMotions(path_per_s, *run_.atlas, map, *run_.camera, records);
  run_.mapper->ChangeMotionsIn(
      map, MotionsOfKeyframes(path_per_s, run_.atlas->At(map), run_.first_new_keyframe));
}

}  // namespace deepuav
