#include "deepuav/system/finish/run_finish.h"

#include <algorithm>
#include <exception>

#include "deepuav/base/logging.h"
#include "deepuav/inertial/camera_turns.h"
#include "deepuav/system/finish/bent_start.h"
#include "deepuav/system/finish/calibration_correction.h"
#include "deepuav/system/finish/gap_bridge.h"
#include "deepuav/system/finish/path_smoothing.h"
#include "deepuav/system/shutter/readout_finding.h"
#include "deepuav/system/shutter/readout_following.h"

namespace deepuav {
namespace {

/// The maps, those with most keyframes first: the largest knows the camera best.
std::vector<MapId> ByKeyframes(const Atlas& atlas) {
  std::vector<MapId> maps = atlas.Remaining();
  std::stable_sort(maps.begin(), maps.end(), [&atlas](MapId a, MapId b) {
    return atlas.At(a).KeyframeCount() > atlas.At(b).KeyframeCount();
  });
  return maps;
}

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

void RunFinish::Finish(const std::function<bool()>& asked_to_stop, SlamResult* result) const {
  Stopwatch since_stop;
  const Stop stop = [&] {
    if (!result->stopped && asked_to_stop && asked_to_stop()) {
      result->stopped = true;
      since_stop = {};
    }
    return result->stopped && since_stop.Seconds() > options_.finish_stopped_s;
  };
  const auto attempt = [result](const auto& step) {
    try {
      step();
    } catch (const std::exception& error) {
      if (result->failure.empty()) result->failure = error.what();
    }
  };
  attempt([&] { AdjustAll(stop, result); });
  attempt([&] { LocateDoubtful(stop, &result->frames); });
  attempt([&] { MakeMetricAll(stop, result); });
  BriefMaps brief(run_.atlas, run_.first_new_keyframe, options_.max_brief_frames);
  if (!options_.localise_only) attempt([&] { brief.SetAside(&result->frames); });
  std::vector<ReckonedFrame> reckoned;
  attempt([&] { reckoned = BridgeByImu(result); });
  attempt([&] { GeoreferenceAll(stop, result); });
  std::vector<std::shared_ptr<const Features>> features;
  for (const FrameRecord& record : result->frames) features.push_back(record.features);
  attempt([&] { FinishTrajectory(stop, &result->frames); });
  attempt([&] { EstimateCovariances(stop, result); });
  attempt([&] { TakeReckoned(*run_.atlas, reckoned, &result->frames); });
  attempt([&] { BridgeGaps(stop, std::move(features), &result->frames); });
  attempt([&] { result->maps_given_up = RestoreBrief(&brief, stop, &result->frames); });
  attempt([&] { SetAsideMoving(); });
}

void RunFinish::AdjustAll(const Stop& stop, SlamResult* result) const {
  if (!Adjusts()) return;
  const std::vector<MapId> maps = ByKeyframes(*run_.atlas);
  for (MapId map : maps) {
    const bool refine = RefinesFocalIn(map), seeks = map == maps.front() && SeeksReadout();
    FollowReadouts(map, !seeks, stop, result);
    run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, refine, stop);
    if (refine) Log().info("focal length refined to {:.1f} px", run_.camera->pinhole.fx);
    StraightenStart(map, !seeks, stop, result);
    if (seeks) FindReadoutIn(map, stop, result);
    if (map == maps.front() && MayCorrectCalibration()) {
      result->lens = CorrectCalibration(map, options_.mapping.lens, run_.mapper, run_.camera,
                                        &result->frames, stop);
    }
    if (stop()) break;
  }
}

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

void RunFinish::KeepTurns(const ImageTurns& turns, MapId map, SlamResult* result) const {
  for (const auto& [time, motion] : turns.motions)
    result->image_turns.insert_or_assign(time, motion);
  if (map == ByKeyframes(*run_.atlas).front())
    result->image_turns_saved_share = std::max(result->image_turns_saved_share, turns.saved_share);
}

ReadoutFollowing RunFinish::MakeReadoutFollowing(const TrajectoryFinish& finish) const {
  return {options_.readout,
          options_.image_turns,
          options_.mapping.readout,
          {run_.camera, run_.atlas, run_.mapper, run_.first_new_keyframe},
          finish};
}

void RunFinish::StraightenStart(MapId map, bool ask_images, const Stop& stop,
                                SlamResult* result) const {
  PlaceInMaps(*run_.atlas, &result->frames);
  FrameLocator locator(*run_.camera, options_.tracking.locator, run_.matcher, nullptr);
  const BentStart bent(run_.camera->pinhole, options_.bent_start, options_.mapping.local_map,
                       options_.young_map_frames, run_.first_new_keyframe, &locator);
  std::vector<KeyframeRelocation> relocations;
  {
    const StageScope stage(run_.clock, "look for a bent start");
    relocations = bent.FindIn(run_.atlas->At(map), result->frames, stop);
  }
  if (relocations.empty()) return;
  Log().info("map {}: {} of its first keyframes set right by what came later", map.value,
             relocations.size());
  run_.mapper->Relocate(map, relocations);
  FollowReadouts(map, ask_images, stop, result);
  run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, false, stop);
}

bool RunFinish::SeeksReadout() const {
  const bool goes_on = run_.first_new_keyframe.value > 0;
  const bool is_wanted = run_.camera->readout_s == 0 || options_.mapping.readout.refine_known;
  return options_.mapping.readout.enabled && is_wanted && !goes_on;
}

void RunFinish::FindReadoutIn(MapId map, const Stop& stop, SlamResult* result) const {
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  const ReadoutFinding finding(
      options_.readout, options_.mapping.readout,
      {run_.camera, run_.atlas, run_.mapper, run_.sensors.imu, options_.sensors.imu.max_imu_gap_s,
       run_.first_new_keyframe},
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); });
  result->readout = finding.FindIn(map, stop, &result->frames);
  if (run_.camera->readout_s == 0) return FindReadoutByImages(map, stop, result);
  ImageTurns turns = AskImages(map, options_.image_turns.min_cost_share, stop, result);
  if (turns.motions.empty()) return;
  if (options_.mapping.readout.refine_known)
    return RefineReadoutByImages(map, std::move(turns), stop, result);
  run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, false, stop);
}

void RunFinish::FindReadoutByImages(MapId map, const Stop& stop, SlamResult* result) const {
  if (result->stopped) return;
  AssumedReadout assumed(options_.image_turns.assumed_readout_s, run_.camera);
  ImageTurns turns = AskImages(map, options_.image_turns.untold_cost_share, stop, result);
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
  run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, false, stop);
}

bool RunFinish::MayCorrectCalibration() const {
  const bool goes_on = run_.first_new_keyframe.value > 0;
  return options_.mapping.lens.enabled && !options_.refine_focal && !goes_on;
}

bool RunFinish::RefinesFocalIn(MapId map) const {
  return options_.refine_focal && run_.camera->distortion.empty() &&
         map == ByKeyframes(*run_.atlas).front();
}

void RunFinish::MakeMetricAll(const Stop& stop, SlamResult* result) const {
  if (run_.sensors.imu.samples.empty() || options_.localise_only) return;
  const StageScope stage(run_.clock, "inertial");
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  InertialGauge gauge(
      run_.sensors.imu, options_.sensors.imu,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); }, run_.mapper,
      run_.atlas);
  result->inertial = gauge.ApplyToAll(ByKeyframes(*run_.atlas), result->frames, stop);
}

std::vector<ReckonedFrame> RunFinish::BridgeByImu(SlamResult* result) const {
  if (result->inertial.empty()) return {};
  const StageScope stage(run_.clock, "inertial");
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  InertialBridge bridge(
      run_.sensors.imu, options_.sensors.imu,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); }, result->inertial,
      run_.mapper, run_.atlas);
  result->maps_joined_by_imu = bridge.JoinMaps(result->frames);
  return bridge.Reckon(result->frames);
}

void RunFinish::GeoreferenceAll(const Stop& stop, SlamResult* result) const {
  if (run_.sensors.gnss.fixes.empty() || options_.localise_only) return;
  const StageScope stage(run_.clock, "georeference");
  MetricPriors priors;
  for (const auto& [map, attempt] : result->inertial) {
    if (attempt.found) priors[map] = {attempt.found->scale_sigma, attempt.found->tilt_sigma_rad};
  }
  Georeferencing georeferencing(run_.sensors, options_.sensors, priors, run_.mapper, run_.atlas);
  result->georeferences = georeferencing.ApplyToAll(
      ByKeyframes(*run_.atlas), result->frames, &run_.camera->pinhole,
      [this](MapId map) { return RefinesFocalIn(map); }, stop);
}

TrajectoryFinish RunFinish::MakeTrajectoryFinish(FrameLocator* locator) const {
  return {*run_.camera,
          options_.tracking.locator,
          options_.mapping.local_map,
          options_.max_gap_frames,
          *run_.atlas,
          run_.first_new_keyframe,
          locator};
}

void RunFinish::EstimateCovariances(const Stop& stop, SlamResult* result) const {
  if (!Adjusts()) return;
  const StageScope stage(run_.clock, "covariances");
  result->covariances =
      EstimateMapCovariances(*run_.atlas, run_.camera->pinhole, options_.mapping.global_bundle,
                             result->georeferences, stop);
}

FrameLocator RunFinish::MakeThoroughLocator() const {
  LocatorOptions thorough = options_.tracking.locator;
  thorough.reference_tries = options_.end_reference_tries;
  return {*run_.camera, thorough, run_.matcher, nullptr};
}

void RunFinish::LocateDoubtful(const Stop& stop, std::vector<FrameRecord>* records) const {
  PlaceInMaps(*run_.atlas, records);
  const StageScope stage(run_.clock, "finish trajectory");
  FrameLocator locator = MakeThoroughLocator();
  MakeTrajectoryFinish(&locator).LocateDoubtful(records, stop);
}

void RunFinish::FinishTrajectory(const Stop& stop, std::vector<FrameRecord>* records) const {
  PlaceInMaps(*run_.atlas, records);
  const StageScope stage(run_.clock, "finish trajectory");
  FrameLocator locator = MakeThoroughLocator();
  MakeTrajectoryFinish(&locator).Finish(records, stop);
  PathSmoothing(options_.smoothing, *run_.atlas).Smooth(records);
}

int RunFinish::RestoreBrief(BriefMaps* brief, const Stop& stop,
                            std::vector<FrameRecord>* records) const {
  const StageScope stage(run_.clock, "finish trajectory");
  FrameLocator locator = MakeThoroughLocator();
  return brief->Restore(MakeTrajectoryFinish(&locator), stop, run_.mapper, records);
}

void RunFinish::BridgeGaps(const Stop& stop, std::vector<std::shared_ptr<const Features>> features,
                           std::vector<FrameRecord>* records) const {
  const StageScope stage(run_.clock, "bridge gaps");
  const GapSight sight{*run_.camera, options_.tracking.locator, options_.mapping.local_map,
                       run_.matcher};
  const int placed =
      GapBridge(sight, options_.gaps, *run_.atlas, std::move(features)).Bridge(records, stop);
  if (placed > 0) Log().info("{} lost frames are placed between those about them", placed);
}

void RunFinish::SetAsideMoving() const {
  if (!Adjusts()) return;
  for (const MapId map : run_.atlas->Remaining()) run_.mapper->SetAsideMoving(map);
}

}  // namespace deepuav
