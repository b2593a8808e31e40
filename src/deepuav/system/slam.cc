#include "deepuav/system/slam.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/system/calibration_correction.h"
#include "deepuav/system/gap_bridge.h"

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

TrackingOptions TrackingIn(const SystemOptions& options) {
  TrackingOptions tracking = options.tracking;
  tracking.starts_maps = !options.localise_only;
  return tracking;
}

/// Gives located frames the poses that the maps as they are give them.
void PlaceInMaps(const Atlas& atlas, std::vector<FrameRecord>* records) {
  for (FrameRecord& record : *records) {
    if (!record.located()) continue;
    record.map = atlas.Current(record.map);
    record.cam_from_world = atlas.At(record.map).PoseOf(record.pose);
  }
}

SystemOptions WithSharedPatches(SystemOptions options) {
  options.tracking.locator.patches = options.mapping.patches = options.patches;
  return options;
}

}  // namespace

Slam::Slam(const Camera& camera, const SystemOptions& options, const Perception& perception)
    : camera_(camera),
      options_(WithSharedPatches(options)),
      perception_(perception),
      matcher_(perception.matcher),
      mapper_(camera, options_.mapping, &atlas_, &clock_,
              perception.matcher_is_learned ? &matcher_ : nullptr),
      places_(MakePlaces()),
      back_end_(&atlas_, &mapper_, places_ ? &*places_ : nullptr, MakeLoopCloser(),
                perception.turned, options.adjustment_delay_keyframes, &clock_),
      tracker_(camera, TrackingIn(options_), &matcher_, &clock_),
      relocaliser_(camera, options_.tracking.relocaliser, options_.tracking.locator,
                   MatchersOfPlaces(), &clock_) {
  options_.Check();
  clock_.RememberLatest(static_cast<size_t>(options_.max_records));
}

PlaceMatchers Slam::MatchersOfPlaces() {
  if (!perception_.quick_matcher) return {&matcher_};
  if (!quick_matcher_) quick_matcher_.emplace(perception_.quick_matcher);
  return {&*quick_matcher_, &matcher_};
}

std::optional<PlaceMemory> Slam::MakePlaces() const {
  if (!perception_.vocabulary) return std::nullopt;
  return PlaceMemory(perception_.vocabulary, options_.looping.recogniser);
}

LoopCloser* Slam::MakeLoopCloser() {
  if (!places_ || !options_.looping.enabled) return nullptr;
  // A loop that the quick matcher misses is there for the next keyframe, too; every keyframe asks.
  const PlaceMatchers matchers{MatchersOfPlaces().quick};
  return &loop_closer_.emplace(camera_, options_.looping, options_.tracking.locator, &*places_,
                               matchers, &clock_);
}

void Slam::Load(Atlas atlas) {
  atlas_ = std::move(atlas);
  first_new_keyframe_.value = atlas_.ids().keyframes;
  mapper_.Resume();
  if (!places_) return;
  for (MapId map : atlas_.Remaining()) {
    atlas_.At(map).keyframes().ForEach(
        [this](const Keyframe& keyframe) { places_->Remember(keyframe); });
  }
}

void Slam::Observe(RunObserver* observer) {
  observer_ = observer;
  back_end_.Observe(observer);
  if (!observer) return clock_.Tell(nullptr);
  clock_.Tell(
      [observer](const std::string& stage, double seconds) { observer->OnStage(stage, seconds); });
}

SlamResult Slam::Run(ImageSource* images, Schedule schedule, const Progress& progress,
                     const std::function<bool()>& stop) {
  SlamResult result;
  // Asked by the thread of the images, which may wait for the next one's time.
  std::atomic<bool> ended{false};
  LiveImages live_images(images, [&ended, &stop] { return ended || (stop && stop()); });
  const bool live = schedule == Schedule::kLive;
  for (const MapId map : atlas_.Remaining()) {
    if (observer_) observer_->OnGauge(map, atlas_.At(map).revision(), atlas_.GaugeOf(map));
  }
  back_end_.StopWhen(stop);
  {
    std::optional<ReadoutTurns> turns;
    if (camera_.readout_s > 0)
      turns.emplace(sensors_.imu, options_.sensors.imu.max_imu_gap_s, camera_);
    SequentialFeed sequential(live && !images->KeepsPace() ? &live_images : images,
                              perception_.extractor, &clock_, turns ? &*turns : nullptr);
    std::optional<PrefetchingFeed> prefetching;
    std::unique_ptr<MappingLane> mapping;
    if (schedule == Schedule::kSequential) {
      mapping = std::make_unique<SequentialLane>(&back_end_);
    } else {
      back_end_.AdjustBeside(live);
      mapping = std::make_unique<ThreadedLane>(&back_end_);
      prefetching.emplace(&sequential, live ? 1 : options_.frames_ahead);
    }
    FrameFeed* feed = prefetching ? static_cast<FrameFeed*>(&*prefetching) : &sequential;
    ProcessAll(feed, mapping.get(), live, progress, stop, &result);
    ended = true;
  }
  if (sensors_at_end_) sensors_ = sensors_at_end_();
  Finish(stop, &result);
  result.skipped_late = live_images.skipped();
  result.relocalisations = relocalisations_;
  result.closed_loops = back_end_.closed_loops();
  result.merged_maps = back_end_.merged_maps();
  result.landmarks_set_aside = mapper_.set_aside();
  result.stage_durations_s = clock_.Durations();
  return result;
}

void Slam::ProcessAll(FrameFeed* feed, MappingLane* mapping, bool live, const Progress& progress,
                      const std::function<bool()>& stop, SlamResult* result) {
  RecordKeeper records({options_.min_neighbour_share, options_.max_unlocated_frames,
                        options_.full_record_frames, options_.old_record_landmarks,
                        options_.max_records});
  try {
    while (true) {
      result->stopped = stop && stop();
      if (result->stopped) break;
      const std::optional<Frame> frame = feed->Next();
      if (!frame) {
        result->stopped = live && stop && stop();
        break;
      }
      result->frames.push_back(Process(*frame, mapping, live));
      records.Limit(&result->frames);
      if (std::exchange(result->forgotten_frames, records.forgotten()) != records.forgotten())
        ForgetRemoved(mapping, *result);
      if (observer_) observer_->OnFrame(result->frames.back(), *frame);
      if (progress) progress(result->frames.back());
      if (meanwhile_.due && meanwhile_.due()) SaveMeanwhile(mapping, *result);
    }
    records.End(&result->frames);
    if (keyframe_under_way_) mapping->Collect();
    mapping->Settle();
  } catch (const std::exception& error) {
    result->failure = error.what();
  }
}

FrameRecord Slam::Process(const Frame& frame, MappingLane* mapping, bool live) {
  const StageScope stage(&clock_, "track");
  CollectLocalMap(frame, mapping, live);
  TrackingResult result = tracker_.Track(frame, !keyframe_under_way_);
  if (!result.pose) {
    if (auto found = Relocalise(frame, mapping)) {
      result = std::move(*found);
    } else if (result.initial_map) {
      if (StartMap(*result.initial_map, mapping)) {
        result = tracker_.Track(frame, true);
      } else {
        result.reason = "the first two views did not hold as a map";
      }
    }
  }
  if (options_.localise_only) FollowInUnchangedMap(&result);
  if (!result.reason.empty()) Log().debug("frame {}: {}", frame.id.value, result.reason);
  if (result.keyframe) {
    keyframe_under_way_ = frame.id;
    mapping->Submit(std::move(*result.keyframe));
  }
  return MakeRecord(frame, result);
}

void Slam::FollowInUnchangedMap(TrackingResult* result) {
  result->keyframe.reset();
  if (!result->pose) return;
  const TrackedPose& pose = *result->pose;
  if (pose.anchored.keyframe == surroundings_of_) return;
  surroundings_of_ = pose.anchored.keyframe;
  tracker_.UseLocalMap(
      MakeLocalMap(atlas_.At(pose.map), surroundings_of_, options_.mapping.local_map));
}

bool Slam::StartMap(const InitialMapRequest& request, MappingLane* mapping) {
  if (keyframe_under_way_) mapping->Collect();
  keyframe_under_way_.reset();
  const LocalMapPtr local_map = mapping->StartMap(request);
  if (!local_map) return false;
  Log().info("map {} starts at frame {}", local_map->map.value, request.first.id.value);
  tracker_.Begin(local_map);
  return true;
}

std::optional<TrackingResult> Slam::Relocalise(const Frame& frame, MappingLane* mapping) {
  if (!places_ || frame.features->size() < options_.tracking.relocaliser.min_inliers)
    return std::nullopt;
  const StageScope stage(&clock_, "relocalise");
  if (keyframe_under_way_) tracker_.UseLocalMap(mapping->Collect());
  keyframe_under_way_.reset();
  mapping->Settle();
  if (atlas_.Remaining().empty()) return std::nullopt;
  std::optional<TrackingResult> result = RelocaliseUnder(frame, {});
  if (!result && perception_.turned && TurnsAt(frame.time)) {
    const TurnedDescriptors turned =
        perception_.turned->Describe(frame.image->image(), *frame.features);
    result = RelocaliseUnder(frame, turned);
  }
  if (!result) return std::nullopt;
  Log().info("frame {} is recognised in map {}", frame.id.value, result->pose->map.value);
  ++relocalisations_;
  return result;
}

bool Slam::TurnsAt(Timestamp time) {
  const bool due =
      !turned_at_ || std::abs(SecondsBetween(*turned_at_, time)) >= options_.turned_interval_s;
  if (due) turned_at_ = time;
  return due;
}

std::optional<TrackingResult> Slam::RelocaliseUnder(const Frame& frame,
                                                    std::span<const Descriptors> turned) {
  std::vector<LocalMapPtr> surroundings;
  std::vector<int> headings;
  for (const PlaceCandidate& place : places_->PlacesLike(atlas_, *frame.features, turned)) {
    surroundings.push_back(
        MakeLocalMap(atlas_.At(place.map), place.keyframe, options_.mapping.local_map));
    headings.push_back(place.view);
  }
  if (surroundings.empty()) return std::nullopt;
  const auto found = relocaliser_.Relocalise(frame, turned, surroundings, nullptr, headings);
  if (!found) return std::nullopt;
  return tracker_.Resume(frame, surroundings[static_cast<size_t>(found->candidate)],
                         found->located);
}

void Slam::CollectLocalMap(const Frame& frame, MappingLane* mapping, bool live) {
  if (!keyframe_under_way_) return;
  const bool due = frame.id.value - keyframe_under_way_->value >= options_.map_delay_frames;
  if (live ? !mapping->Ready() : !due) return;
  const StageScope stage(&clock_, "wait for local map");
  tracker_.UseLocalMap(mapping->Collect());
  keyframe_under_way_.reset();
}

SlamResult Slam::ResultSoFar(const SlamResult& result) const {
  SlamResult so_far;
  so_far.relocalisations = relocalisations_;
  so_far.forgotten_frames = result.forgotten_frames;
  so_far.frames.reserve(result.frames.size());
  for (const FrameRecord& record : result.frames) so_far.frames.push_back(WithoutWhatItSaw(record));
  return so_far;
}

void Slam::SaveMeanwhile(MappingLane* mapping, const SlamResult& result) {
  auto so_far = std::make_shared<SlamResult>(ResultSoFar(result));
  mapping->Visit([this, so_far] {
    Atlas copy = atlas_;
    so_far->closed_loops = back_end_.closed_loops();
    so_far->merged_maps = back_end_.merged_maps();
    so_far->landmarks_set_aside = mapper_.set_aside();
    so_far->stage_durations_s = clock_.Durations();
    PlaceInMaps(copy, &so_far->frames);
    meanwhile_.take(std::move(*so_far), std::move(copy));
  });
}

void Slam::ForgetRemoved(MappingLane* mapping, const SlamResult& result) {
  auto referred =
      std::make_shared<MapReferences>(ReferencesOf(result.frames, tracker_.local_map()));
  mapping->Change([this, referred] { forgetter_.Forget(std::move(*referred), &atlas_); });
}

void Slam::AdjustAll(const std::function<bool()>& stop, SlamResult* result) {
  back_end_.DropAdjustment();
  if (!options_.adjust_at_end || options_.localise_only) return;
  const std::vector<MapId> maps = ByKeyframes(atlas_);
  for (MapId map : maps) {
    const bool refine = RefinesFocalIn(map);
    mapper_.AdjustGlobally(map, &camera_.pinhole, refine, stop);
    if (refine) Log().info("focal length refined to {:.1f} px", camera_.pinhole.fx);
    if (map == maps.front() && MayCorrectCalibration()) {
      result->lens =
          CorrectCalibration(map, options_.mapping.lens, &mapper_, &camera_, &result->frames, stop);
    }
    if (stop()) break;
  }
}

bool Slam::MayCorrectCalibration() const {
  const bool goes_on = first_new_keyframe_.value > 0;
  return options_.mapping.lens.enabled && !options_.refine_focal && !goes_on;
}

bool Slam::RefinesFocalIn(MapId map) const {
  return options_.refine_focal && camera_.distortion.empty() && map == ByKeyframes(atlas_).front();
}

void Slam::MakeMetricAll(const std::function<bool()>& stop, SlamResult* result) {
  if (sensors_.imu.samples.empty() || options_.localise_only) return;
  const StageScope stage(&clock_, "inertial");
  const TrajectoryFinish finish = MakeFinish(nullptr);
  InertialGauge gauge(
      sensors_.imu, options_.sensors.imu,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); }, &mapper_,
      &atlas_);
  result->inertial = gauge.ApplyToAll(ByKeyframes(atlas_), result->frames, stop);
}

std::vector<ReckonedFrame> Slam::BridgeByImu(SlamResult* result) {
  if (result->inertial.empty()) return {};
  const StageScope stage(&clock_, "inertial");
  const TrajectoryFinish finish = MakeFinish(nullptr);
  InertialBridge bridge(
      sensors_.imu, options_.sensors.imu,
      [&finish](const FrameRecord& record) { return finish.RefinedPose(record); }, result->inertial,
      &mapper_, &atlas_);
  result->maps_joined_by_imu = bridge.JoinMaps(result->frames);
  return bridge.Reckon(result->frames);
}

void Slam::GeoreferenceAll(const std::function<bool()>& stop, SlamResult* result) {
  if (sensors_.gnss.fixes.empty() || options_.localise_only) return;
  const StageScope stage(&clock_, "georeference");
  MetricPriors priors;
  for (const auto& [map, attempt] : result->inertial) {
    if (attempt.found) priors[map] = {attempt.found->scale_sigma, attempt.found->tilt_sigma_rad};
  }
  Georeferencing georeferencing(sensors_, options_.sensors, priors, &mapper_, &atlas_);
  result->georeferences = georeferencing.ApplyToAll(
      ByKeyframes(atlas_), result->frames, &camera_.pinhole,
      [this](MapId map) { return RefinesFocalIn(map); }, stop);
}

TrajectoryFinish Slam::MakeFinish(FrameLocator* locator) const {
  return {camera_,
          options_.tracking.locator,
          options_.mapping.local_map,
          options_.max_gap_frames,
          atlas_,
          first_new_keyframe_,
          locator};
}

void Slam::EstimateCovariances(const std::function<bool()>& stop, SlamResult* result) {
  if (!options_.adjust_at_end || options_.localise_only) return;
  const StageScope stage(&clock_, "covariances");
  result->covariances = EstimateMapCovariances(
      atlas_, camera_.pinhole, options_.mapping.global_bundle, result->georeferences, stop);
}

void Slam::FinishTrajectory(const std::function<bool()>& stop, std::vector<FrameRecord>* records) {
  PlaceInMaps(atlas_, records);
  const StageScope stage(&clock_, "finish trajectory");
  LocatorOptions thorough = options_.tracking.locator;
  thorough.reference_tries = options_.end_reference_tries;
  FrameLocator locator(camera_, thorough, &matcher_, nullptr);
  MakeFinish(&locator).Finish(records, stop);
}

void Slam::BridgeGaps(const std::function<bool()>& stop,
                      std::vector<std::shared_ptr<const Features>> features,
                      std::vector<FrameRecord>* records) {
  const StageScope stage(&clock_, "bridge gaps");
  const GapSight sight{camera_, options_.tracking.locator, options_.mapping.local_map, &matcher_};
  const int placed =
      GapBridge(sight, options_.gaps, atlas_, std::move(features)).Bridge(records, stop);
  if (placed > 0) Log().info("{} lost frames are placed between those about them", placed);
}

void Slam::SetAsideMoving() {
  if (!options_.adjust_at_end || options_.localise_only) return;
  for (const MapId map : atlas_.Remaining()) mapper_.SetAsideMoving(map);
}

void Slam::Finish(const std::function<bool()>& asked_to_stop, SlamResult* result) {
  Stopwatch since_stop;
  const std::function<bool()> stop = [&] {
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
  attempt([&] { MakeMetricAll(stop, result); });
  std::vector<ReckonedFrame> reckoned;
  attempt([&] { reckoned = BridgeByImu(result); });
  attempt([&] { GeoreferenceAll(stop, result); });
  std::vector<std::shared_ptr<const Features>> features;
  for (const FrameRecord& record : result->frames) features.push_back(record.features);
  attempt([&] { FinishTrajectory(stop, &result->frames); });
  attempt([&] { EstimateCovariances(stop, result); });
  attempt([&] { TakeReckoned(atlas_, reckoned, &result->frames); });
  attempt([&] { BridgeGaps(stop, std::move(features), &result->frames); });
  attempt([&] { SetAsideMoving(); });
}

}  // namespace deepuav
