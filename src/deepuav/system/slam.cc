#include "deepuav/system/slam.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/system/finish/run_finish.h"
#include "deepuav/system/frames/live_images.h"

namespace deepuav {

namespace {

TrackingOptions TrackingIn(const SystemOptions& options) {
  TrackingOptions tracking = options.tracking;
  tracking.starts_maps = !options.localise_only;
  return tracking;
}

SystemOptions WithSharedPatches(SystemOptions options) {
  options.tracking.locator.patches = options.mapping.patches = options.patches;
  return options;
}

}  // namespace

Schedule ParseSchedule(const std::string& name) {
  if (name == "sequential") return Schedule::kSequential;
  if (name == "threaded") return Schedule::kThreaded;
  if (name == "live") return Schedule::kLive;
  throw Error("schedule is '{}': expected sequential, threaded or live", name);
}

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
      image_fixed_(camera, options_.image_fixed),
      lost_frames_(camera, options_, places_ ? &*places_ : nullptr, perception.turned,
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
    const CameraTurns turns(HearsTurns(sensors_.imu) ? sensors_.imu : ImuStream{},
                            options_.sensors.imu.max_imu_gap_s, camera_);
    SequentialFeed sequential(live && !images->KeepsPace() ? &live_images : images,
                              perception_.extractor, &clock_, &turns);
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
  back_end_.DropAdjustment();
  RunFinish(options_,
            {&camera_, &atlas_, &mapper_, &matcher_, &clock_, sensors_, first_new_keyframe_})
      .Finish(stop, &result);
  result.skipped_late = live_images.skipped();
  result.relocalisations = relocalisations_;
  result.closed_loops = back_end_.closed_loops();
  result.merged_maps = back_end_.merged_maps();
  result.landmarks_set_aside = mapper_.set_aside();
  result.image_fixed = image_fixed_.region();
  result.image_fixed_keypoint_share =
      static_cast<double>(left_out_keypoints_) /
      static_cast<double>(std::max<int64_t>(1, keypoints_since_known_));
  result.stage_durations_s = clock_.Durations();
  return result;
}

void Slam::ProcessAll(FrameFeed* feed, MappingLane* mapping, bool live, const Progress& progress,
                      const std::function<bool()>& stop, SlamResult* result) {
  RecordKeeper records({options_.min_neighbour_share, options_.max_unlocated_frames,
                        options_.young_map_frames, options_.max_brief_s,
                        options_.full_record_frames, options_.old_record_landmarks,
                        options_.max_records});
  try {
    while (true) {
      result->stopped = stop && stop();
      if (result->stopped) break;
      const std::optional<Frame> taken = feed->Next();
      if (!taken) {
        result->stopped = live && stop && stop();
        break;
      }
      const Frame frame = WithoutWhatIsFixed(*taken);
      TrackingResult tracked = Process(frame, mapping, live);
      if (tracked.pose) LearnWhatIsFixed(*taken, *tracked.pose, mapping);
      result->frames.push_back(MakeRecord(frame, tracked));
      records.Limit(&result->frames);
      if (std::exchange(result->forgotten_frames, records.forgotten()) != records.forgotten())
        ForgetRemoved(mapping, *result);
      if (observer_) observer_->OnFrame(result->frames.back(), frame);
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

TrackingResult Slam::Process(const Frame& frame, MappingLane* mapping, bool live) {
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
  return result;
}

Frame Slam::WithoutWhatIsFixed(const Frame& taken) {
  if (image_fixed_.region().empty()) return taken;
  Frame frame = image_fixed_.Without(taken);
  keypoints_since_known_ += taken.features->size();
  left_out_keypoints_ += taken.features->size() - frame.features->size();
  return frame;
}

void Slam::LearnWhatIsFixed(const Frame& frame, const TrackedPose& pose, MappingLane* mapping) {
  const StageScope stage(&clock_, "learn what is fixed");
  const bool is_first = image_fixed_.region().empty();
  if (!image_fixed_.Learn(frame, pose)) return;
  const ImageRegion& region = image_fixed_.region();
  Log().log(is_first ? spdlog::level::info : spdlog::level::debug,
            "frame {}: something fixed to the camera hides {:.1f} % of its images: it is left out",
            frame.id.value, 100 * region.Share());
  if (!options_.localise_only) mapping->Change([this, region] { mapper_.SetAsideIn(region); });
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
  if (!lost_frames_.MayFind(frame)) return std::nullopt;
  const StageScope stage(&clock_, "relocalise");
  if (keyframe_under_way_) tracker_.UseLocalMap(mapping->Collect());
  keyframe_under_way_.reset();
  mapping->Settle();
  const auto found = lost_frames_.Find(frame, atlas_);
  if (!found) return std::nullopt;
  TrackingResult result = tracker_.Resume(frame, found->surroundings, found->located);
  Log().info("frame {} is recognised in map {}", frame.id.value, result.pose->map.value);
  ++relocalisations_;
  return result;
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

}  // namespace deepuav
