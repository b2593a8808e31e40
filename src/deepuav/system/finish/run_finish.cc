#include "deepuav/system/finish/run_finish.h"

#include <exception>

#include "deepuav/base/logging.h"
#include "deepuav/system/finish/bent_start.h"
#include "deepuav/system/finish/calibration_correction.h"
#include "deepuav/system/finish/gap_bridge.h"
#include "deepuav/system/finish/path_smoothing.h"
#include "deepuav/system/sensors/placed_maps.h"

namespace deepuav {

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
  BriefMaps brief(run_.atlas, run_.first_new_keyframe, options_.max_brief_s);
  std::vector<ReckonedFrame> reckoned;
  attempt([&] { reckoned = BridgeByImu(&brief, result); });
  attempt([&] { GeoreferenceAll(stop, result); });
  if (!options_.localise_only) attempt([&] { brief.SetAside(&result->frames); });
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
  // The largest knows the camera best.
  const std::vector<MapId> maps = run_.atlas->BySize();
  for (MapId map : maps) {
    const bool refine = RefinesFocalIn(map), seeks = map == maps.front() && SeeksReadout();
    FollowReadouts(map, !seeks, stop, result);
    run_.mapper->AdjustGlobally(map, &run_.camera->pinhole, refine, stop);
    if (refine) Log().info("focal length refined to {:.1f} px", run_.camera->pinhole.fx);
    StraightenStart(map, !seeks, stop, result);
    if (seeks) FindReadoutIn(map, stop, result);
    if (map == maps.front() && MayCorrectCalibration()) CheckCalibration(map, stop, result);
    if (stop()) break;
  }
}

void RunFinish::CheckCalibration(MapId map, const Stop& stop, SlamResult* result) const {
  LensSearchOptions search = options_.mapping.lens;
  // Images that turned while they were read bend what a map says of its lens.
  if (!result->image_turns.empty()) search.min_large_share = search.min_cost_share;
  const bool is_bent = result->readout || !result->image_turns.empty();
  if (!search.whole && !is_bent && !result->stopped)
    result->focal_doubt = DoubtFocal(map, search, *run_.camera, *run_.mapper, stop);
  // A distortion would take up a part of what is wrong with the focal length, and hide it.
  if (result->focal_doubt) return;
  const auto corrected =
      CorrectCalibration(map, search, run_.mapper, run_.camera, &result->frames, stop);
  if (corrected) {
    result->lens = corrected->sigmas;
    result->lens_shift_px = corrected->shift_px;
  }
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

bool RunFinish::MayCorrectCalibration() const {
  const bool goes_on = run_.first_new_keyframe.value > 0;
  return options_.mapping.lens.enabled && !options_.refine_focal && !goes_on;
}

bool RunFinish::RefinesFocalIn(MapId map) const {
  return options_.refine_focal && run_.camera->distortion.empty() &&
         map == run_.atlas->BySize().front();
}

bool RunFinish::FixesMayTellFocalIn(MapId map) const {
  return options_.mapping.lens.whole && MayCorrectCalibration() &&
         run_.camera->distortion.empty() && map == run_.atlas->BySize().front();
}

void RunFinish::MakeMetricAll(const Stop& stop, SlamResult* result) const {
  if (run_.sensors.imu.samples.empty() || options_.localise_only) return;
  const StageScope stage(run_.clock, "inertial");
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  InertialGauge gauge(
      run_.sensors.imu, options_.sensors.imu,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); }, run_.mapper,
      run_.atlas);
  result->inertial = gauge.ApplyToAll(run_.atlas->BySize(), result->frames, stop);
}

std::vector<ReckonedFrame> RunFinish::BridgeByImu(BriefMaps* brief, SlamResult* result) const {
  if (result->inertial.empty()) return {};
  const StageScope stage(run_.clock, "inertial");
  const TrajectoryFinish finish = MakeTrajectoryFinish(nullptr);
  InertialBridge bridge(
      run_.sensors.imu, options_.sensors.imu,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); }, result->inertial,
      run_.mapper, run_.atlas);
  result->maps_joined_by_imu = bridge.JoinMaps(result->frames);
  // A brief map may lie in what the samples lead through.
  brief->SetAside(&result->frames);
  std::vector<ReckonedFrame> reckoned = bridge.Reckon(result->frames);
  brief->PutBack(&result->frames);
  return reckoned;
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
      run_.atlas->BySize(), result->frames, &run_.camera->pinhole,
      [this](MapId map) { return RefinesFocalIn(map) || FixesMayTellFocalIn(map); }, stop);
  result->maps_joined_by_fixes = JoinPlacedMaps(options_.sensors.georeference.join_max_sigma_m,
                                                &result->georeferences, run_.mapper, run_.atlas);
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
