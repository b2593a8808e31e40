#include "deepuav/system/slam.h"

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/system/trajectory_finish.h"

namespace deepuav {

Schedule ParseSchedule(const std::string& name) {
  if (name == "sequential") return Schedule::kSequential;
  if (name == "threaded") return Schedule::kThreaded;
  if (name == "live") return Schedule::kLive;
  throw Error("schedule is '{}': expected sequential, threaded or live", name);
}

void SystemOptions::Check() const {
  CheckOption(map_delay_frames >= 1, "system.map_delay_frames", map_delay_frames, "at least 1");
  CheckOption(frames_ahead >= 1, "system.frames_ahead", frames_ahead, "at least 1");
  CheckOption(max_unlocated_frames >= 0, "system.max_unlocated_frames", max_unlocated_frames,
              "0 or more");
  tracking.Check();
  mapping.Check();
}

void RegisterOptions(SystemOptions* options, OptionRegistry* registry) {
  registry->Add("system", options);
  TrackingOptions& tracking = options->tracking;
  registry->Add("tracking", &tracking);
  registry->Add("tracking", &tracking.locator);
  registry->Add("tracking.visibility", &tracking.locator.visibility);
  registry->Add("tracking.projection", &tracking.locator.projection);
  registry->Add("tracking.absolute_pose", &tracking.locator.absolute_pose);
  registry->Add("tracking.motion_only", &tracking.locator.motion_only);
  registry->Add("initialiser", &tracking.initialiser);
  registry->Add("initialiser.two_view", &tracking.initialiser.two_view);
  registry->Add("initialiser.absolute_pose", &tracking.initialiser.absolute_pose);
  registry->Add("keyframes", &tracking.keyframes);
  MappingOptions& mapping = options->mapping;
  registry->Add("mapping", &mapping);
  registry->Add("mapping.local_map", &mapping.local_map);
  registry->Add("mapping.creation", &mapping.creation);
  registry->Add("mapping.epipolar", &mapping.creation.epipolar);
  registry->Add("mapping.fusion", &mapping.fusion);
  registry->Add("mapping.fusion.visibility", &mapping.fusion.visibility);
  registry->Add("mapping.fusion.projection", &mapping.fusion.projection);
  registry->Add("mapping.local_bundle", &mapping.local_bundle);
  registry->Add("mapping.global_bundle", &mapping.global_bundle);
}

Slam::Slam(const Camera& camera, const SystemOptions& options, Extractor* extractor,
           Matcher* matcher)
    : camera_(camera),
      options_(options),
      extractor_(extractor),
      matcher_(matcher),
      mapper_(camera, options.mapping, &atlas_, &clock_),
      tracker_(camera, options.tracking, matcher, &clock_) {
  options_.Check();
}

SlamResult Slam::Run(ImageSource* images, Schedule schedule, const Progress& progress,
                     const std::function<bool()>& stop) {
  SlamResult result;
  LiveImages live_images(images);
  const bool live = schedule == Schedule::kLive;
  {
    SequentialFeed sequential(live ? &live_images : images, extractor_, &clock_);
    std::optional<PrefetchingFeed> prefetching;
    std::unique_ptr<MappingLane> mapping;
    if (schedule == Schedule::kSequential) {
      mapping = std::make_unique<SequentialLane>(&mapper_);
    } else {
      mapping = std::make_unique<ThreadedLane>(&mapper_);
      prefetching.emplace(&sequential, live ? 1 : options_.frames_ahead);
    }
    FrameFeed* feed = prefetching ? static_cast<FrameFeed*>(&*prefetching) : &sequential;
    ProcessAll(feed, mapping.get(), live, progress, stop, &result);
  }
  Finish(&result);
  result.skipped_late = live_images.skipped();
  result.stage_durations_s = clock_.Durations();
  return result;
}

void Slam::ProcessAll(FrameFeed* feed, MappingLane* mapping, bool live, const Progress& progress,
                      const std::function<bool()>& stop, SlamResult* result) {
  try {
    while (true) {
      result->stopped = stop && stop();
      if (result->stopped) break;
      const std::optional<Frame> frame = feed->Next();
      if (!frame) break;
      result->frames.push_back(Process(*frame, mapping, live));
      LimitUnlocated(&result->frames);
      if (progress) progress(result->frames.back());
    }
    if (keyframe_under_way_) mapping->Collect();
  } catch (const std::exception& error) {
    result->failure = error.what();
  }
}

FrameRecord Slam::Process(const Frame& frame, MappingLane* mapping, bool live) {
  const StageScope stage(&clock_, "track");
  CollectLocalMap(frame, mapping, live);
  TrackingResult result = tracker_.Track(frame, !keyframe_under_way_);
  if (result.initial_map) {
    if (keyframe_under_way_) mapping->Collect();
    keyframe_under_way_.reset();
    const LocalMapPtr local_map = mapping->StartMap(*result.initial_map);
    if (!local_map) {
      result.reason = "the first two views did not hold as a map";
    } else {
      Log().info("map {} starts at frame {}", local_map->map.value,
                 result.initial_map->first.id.value);
      tracker_.Begin(local_map);
      result = tracker_.Track(frame, true);
    }
  }
  if (!result.reason.empty()) Log().debug("frame {}: {}", frame.id.value, result.reason);
  if (result.keyframe) {
    keyframe_under_way_ = frame.id;
    mapping->Submit(std::move(*result.keyframe));
  }
  return MakeRecord(frame, result);
}

void Slam::CollectLocalMap(const Frame& frame, MappingLane* mapping, bool live) {
  if (!keyframe_under_way_) return;
  const bool due = frame.id.value - keyframe_under_way_->value >= options_.map_delay_frames;
  if (live ? !mapping->Ready() : !due) return;
  const StageScope stage(&clock_, "wait for local map");
  tracker_.UseLocalMap(mapping->Collect());
  keyframe_under_way_.reset();
}

void Slam::LimitUnlocated(std::vector<FrameRecord>* records) {
  if (records->back().located()) return;
  unlocated_.push_back(records->size() - 1);
  if (static_cast<int>(unlocated_.size()) <= options_.max_unlocated_frames) return;
  (*records)[unlocated_.front()].features.reset();
  unlocated_.pop_front();
}

void Slam::Finish(SlamResult* result) {
  for (FrameRecord& record : result->frames) {
    if (record.located()) {
      record.cam_from_world =
          record.cam_from_reference * atlas_.At(record.map).PoseOf(record.reference);
    }
  }
  try {
    if (options_.adjust_at_end) {
      for (const Map& map : atlas_.maps()) mapper_.AdjustGlobally(map.id());
    }
    const StageScope stage(&clock_, "finish trajectory");
    FrameLocator locator(camera_, options_.tracking.locator, matcher_, nullptr);
    TrajectoryFinish(camera_, options_.tracking.locator, options_.mapping.local_map,
                     options_.tracking.max_lost_frames, atlas_, &locator)
        .Finish(&result->frames);
  } catch (const std::exception& error) {
    if (result->failure.empty()) result->failure = error.what();
  }
}

}  // namespace deepuav
