#include <algorithm>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/inertial/camera_turns.h"
#include "deepuav/system/finish/run_finish.h"
#include "deepuav/system/shutter/readout_finding.h"
#include "deepuav/system/shutter/readout_following.h"

namespace deepuav {
namespace {

/// Of a camera of which nothing is known: none again, unless it is kept.
class AssumedReadout {
 public:
  AssumedReadout(double readout_s, Camera* camera) : camera_(camera) {
    camera->readout_s = readout_s;
  }
  AssumedReadout(const AssumedReadout&) = delete;
  AssumedReadout& operator=(const AssumedReadout&) = delete;
  ~AssumedReadout() {
    if (!is_kept_) camera_->readout_s = 0;
  }
  void Keep() { is_kept_ = true; }

 private:
  Camera* camera_;
  bool is_kept_ = false;
};

}  // namespace

void RunFinish::FollowReadouts(MapId map, bool ask_images, const Stop& stop,
                               SlamResult* result) const {
  if (run_.camera->readout_s == 0) return;
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  const bool path_tells = MakeReadoutFollowing(finish).FollowPath(map, stop, &result->frames);
  if (!ask_images) return;
  const ImageTurns turns = AskImages(map, options_.image_turns.min_cost_share, stop, result);
  if (path_tells || !turns.motions.empty()) return;
  Log().warn(
      "map {}: the camera shakes faster than its images come, so that they don't tell "
      "how it turned while its rolling shutter read them: more images a second or an "
      "IMU would",
      map.value);
}

ImageTurns RunFinish::AskImages(MapId map, double min_saved_share, const Stop& stop,
                                SlamResult* result) const {
  if (HearsTurns(run_.sensors.imu)) return {};
  const StageScope stage(run_.clock, "turns of images");
  FrameLocator locator = MakeThoroughLocator();
  const TrajectoryFinish finish = MakeTrajectoryFinish(&locator);
  ImageTurns turns =
      MakeReadoutFollowing(finish).FollowImages(map, min_saved_share, stop, &result->frames);
  KeepTurns(turns, map, result);
  return turns;
}

bool RunFinish::ImagesMayTell(MapId map, double min_saved_share, const Stop& stop,
                              const std::vector<FrameRecord>& frames) const {
  if (HearsTurns(run_.sensors.imu)) return false;
  const StageScope stage(run_.clock, "turns of images");
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  return MakeReadoutFollowing(finish).ImagesMayTell(map, min_saved_share, stop, frames);
}

void RunFinish::KeepTurns(const ImageTurns& turns, MapId map, SlamResult* result) const {
  for (const auto& [time, motion] : turns.motions)
    result->image_turns.insert_or_assign(time, motion);
  if (map == run_.atlas->BySize().front())
    result->image_turns_saved_share = std::max(result->image_turns_saved_share, turns.saved_share);
}

ReadoutFollowing RunFinish::MakeReadoutFollowing(const TrajectoryFinish& finish) const {
  return {options_.readout, options_.image_turns, options_.mapping.readout, MakeReadoutRun(),
          finish};
}

ReadoutRun RunFinish::MakeReadoutRun() const {
  return {run_.camera, run_.atlas, run_.mapper, run_.first_new_keyframe};
}

bool RunFinish::SeeksReadout() const {
  const bool goes_on = run_.first_new_keyframe.value > 0;
  const bool is_wanted = run_.camera->readout_s == 0 || options_.mapping.readout.refine_known;
  return options_.mapping.readout.enabled && is_wanted && !goes_on;
}

void RunFinish::FindReadoutIn(MapId map, const Stop& stop, SlamResult* result) const {
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  const ReadoutFinding finding(
      options_.readout, options_.mapping.readout, MakeReadoutRun(), run_.sensors.imu,
      options_.sensors.imu.max_imu_gap_s,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); });
  result->readout = finding.FindIn(map, stop, &result->frames);
  if (run_.camera->readout_s == 0) return FindReadoutByImages(map, stop, result);
  ImageTurns turns = AskImages(map, options_.image_turns.min_cost_share, stop, result);
  if (turns.motions.empty()) return;
  if (options_.mapping.readout.refine_known)
    return RefineReadoutByImages(map, std::move(turns), stop, result);
  MakeReadoutRun().Adjust(map, stop);
}

void RunFinish::FindReadoutByImages(MapId map, const Stop& stop, SlamResult* result) const {
  if (result->stopped) return;
  AssumedReadout assumed(options_.image_turns.assumed_readout_s, run_.camera);
  const double share = options_.image_turns.untold_cost_share;
  if (!ImagesMayTell(map, share, stop, result->frames)) return;
  ImageTurns turns = AskImages(map, share, stop, result);
  if (turns.motions.empty()) return;
  assumed.Keep();
  result->readout = FoundReadout{0, options_.image_turns.assumed_readout_s / 2, 0};
  RefineReadoutByImages(map, std::move(turns), stop, result);
  Log().info(
      "images turned while they were read, row by row, in {:.1f} ms (standard deviation {:.2f})",
      1000 * run_.camera->readout_s, 1000 * result->readout->sigma_s);
}

void RunFinish::RefineReadoutByImages(MapId map, ImageTurns turns, const Stop& stop,
                                      SlamResult* result) const {
  {
    const StageScope stage(run_.clock, "turns of images");
    const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
    const auto found = MakeReadoutFollowing(finish).FindReadout(map, stop, &result->frames, &turns);
    if (found) result->readout = found;
  }
  KeepTurns(turns, map, result);
  MakeReadoutRun().Adjust(map, stop);
}

}  // namespace deepuav
