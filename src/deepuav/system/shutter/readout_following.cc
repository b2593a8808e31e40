#include "deepuav/system/shutter/readout_following.h"

#include <algorithm>

#include "deepuav/base/logging.h"
#include "deepuav/map/frame_motion.h"
#include "deepuav/system/shutter/readout_rounds.h"

namespace deepuav {

bool ReadoutFollowing::FollowPath(MapId map, const std::function<bool()>& stop,
                                  std::vector<FrameRecord>* records) const {
  for (int round = 0; round < path_.rounds && !stop(); ++round) {
    if (round > 0) run_.Adjust(map, stop);
    const ReadoutPath path = PathOf(map, *records);
    if (!path.tells_turns && !HasMeasuredTurns(*run_.atlas, map, *records)) return false;
    run_.Take(path, map, records);
  }
  return true;
}

bool ReadoutFollowing::ImagesMayTell(MapId map, double min_saved_share,
                                     const std::function<bool()>& stop,
                                     const std::vector<FrameRecord>& records) const {
  if (!AreAsked(map)) return false;
  std::vector<FrameRecord> in_map;
  for (const FrameRecord& record : records) {
    if (record.located() && run_.atlas->Current(record.map) == run_.atlas->Current(map))
      in_map.push_back(record);
  }
  const ImageTurns turns = TurnsOf(map, TurnModel::kTurn, stop, FirstAsked(in_map, images_));
  return turns.saved_share >= images_.first_share * min_saved_share;
}

ImageTurns ReadoutFollowing::FollowImages(MapId map, double min_saved_share,
                                          const std::function<bool()>& stop,
                                          std::vector<FrameRecord>* records) const {
  ImageTurns turns;
  double saved_share = 0;
  const int rounds = AreAsked(map) ? images_.rounds + images_.bend_rounds : 0;
  for (int round = 0; round < rounds && !stop(); ++round) {
    if (round > 0) run_.Adjust(map, stop);
    const TurnModel model = round < images_.rounds ? TurnModel::kTurn : TurnModel::kTurnAndBend;
    ImageTurns found = TurnsOf(map, model, stop, *records);
    Log().debug(
        "map {}: turns of {} images' own save {:.1f} % of their errors, {:.2f} of {:.2f} mrad; {} "
        "turn as the path",
        map.value, found.motions.size(), 100 * found.saved_share, 1e3 * found.changed_rad,
        1e3 * found.noise_rad, found.slow_motions.size());
    if (round == 0) {
      if (!AreBelieved(found, min_saved_share, images_)) return {};
      saved_share = found.saved_share;
      LocateLost(map, stop, records);
    }
    if (found.motions.empty()) break;  // stopped meanwhile
    turns = std::move(found);
    TakeImages(turns, map, records);
  }
  turns.saved_share = saved_share;
  return turns;
}

std::optional<FoundReadout> ReadoutFollowing::FindReadout(MapId map,
                                                          const std::function<bool()>& stop,
                                                          std::vector<FrameRecord>* records,
                                                          ImageTurns* turns) const {
  std::optional<FoundReadout> found;
  for (int round = 0; round < path_.rounds && !stop(); ++round) {
    run_.Adjust(map, stop);
    const auto more = run_.Search(SlowPathPerS(map, *records), map, stop);
    if (!more || more->sigma_s > images_.max_readout_sigma_s) break;
    const double change_s = found ? SumOfRounds(found->change_s, more->change_s) : more->change_s;
    const double before_s = run_.camera->readout_s;
    run_.camera->readout_s = std::clamp(before_s + change_s, search_.min_s, search_.max_s);
    ImageTurns now = TurnsOf(map, TurnModel::kTurnAndBend, stop, *records);
    if (now.motions.empty()) {  // stopped meanwhile
      run_.camera->readout_s = before_s;
      break;
    }
    found = more;
    now.saved_share = turns->saved_share;
    *turns = std::move(now);
    TakeImages(*turns, map, records);
  }
  return found;
}

ReadoutPath ReadoutFollowing::SlowPathPerS(MapId map,
                                           const std::vector<FrameRecord>& records) const {
  constexpr double kOneSecond = 1;
  const PoseOfFrame pose_of_frame = [this](const FrameRecord& record) {
    return finish_.RefinedPose(record);
  };
  ReadoutPath path = FindReadoutPath(*run_.atlas, map, records, pose_of_frame, kOneSecond, path_);
  const auto turns =
      SlowTurns(PathIn(*run_.atlas, map, records, pose_of_frame), kOneSecond, images_);
  for (auto& [time, motion] : path.motions) {
    const auto turn = turns.find(time);
    motion = WithTurnOf(turn == turns.end() ? ReadoutMotion() : turn->second, motion);
  }
  return path;
}

void ReadoutFollowing::TakeImages(const ImageTurns& turns, MapId map,
                                  std::vector<FrameRecord>* records) const {
  ReadoutPath path = PathOf(map, *records);
  TakeTurns(turns, &path);
  run_.Take(path, map, records);
  MarkMeasured(turns, *run_.atlas, map, records);
}

bool ReadoutFollowing::AreAsked(MapId map) const {
  return path_.rounds > 0 && images_.rounds > 0 &&
         run_.atlas->At(map).KeyframeCount() >= images_.min_keyframes;
}

void ReadoutFollowing::LocateLost(MapId map, const std::function<bool()>& stop,
                                  std::vector<FrameRecord>* records) const {
  std::map<size_t, FrameRecord> lost;
  for (size_t i = 0; i < records->size(); ++i) {
    if (!(*records)[i].located()) lost.emplace(i, (*records)[i]);
  }
  PlaceInMaps(*run_.atlas, records);
  finish_.LocateLost(records, stop);
  for (auto& [i, before] : lost) {
    FrameRecord& record = (*records)[i];
    if (!record.located()) continue;
    if (run_.atlas->Current(record.map) != run_.atlas->Current(map)) {
      record = std::move(before);
    } else {
      record.features = std::move(before.features);  // the end looks once more
    }
  }
}

ReadoutPath ReadoutFollowing::PathOf(MapId map, const std::vector<FrameRecord>& records) const {
  ReadoutPath path = FindReadoutPath(
      *run_.atlas, map, records,
      [this](const FrameRecord& record) { return finish_.RefinedPose(record); },
      run_.camera->readout_s, path_);
  KeepMeasuredTurns(records, &path);
  return path;
}

ImageTurns ReadoutFollowing::TurnsOf(MapId map, TurnModel model, const std::function<bool()>& stop,
                                     const std::vector<FrameRecord>& records) const {
  return MeasureImageTurns(
      *run_.atlas, map, records,
      [this](const FrameRecord& record) { return finish_.RefinedPose(record); }, *run_.camera,
      model, images_, stop);
}

}  // namespace deepuav
