#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/features/extractor.h"
#include "deepuav/looping/loop_closer.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/system/frames/frame_feed.h"
#include "deepuav/system/frames/image_source.h"
#include "deepuav/system/frames/lost_frames.h"
#include "deepuav/system/frames/map_references.h"
#include "deepuav/system/frames/record_limits.h"
#include "deepuav/system/lanes/back_end.h"
#include "deepuav/system/lanes/mapping_lane.h"
#include "deepuav/system/lanes/shared_matcher.h"
#include "deepuav/system/slam_result.h"
#include "deepuav/system/system_options.h"
#include "deepuav/system/watching/run_observer.h"
#include "deepuav/system/watching/stage_clock.h"
#include "deepuav/tracking/image_fixed_points.h"
#include "deepuav/tracking/tracker.h"

namespace deepuav {

enum class Schedule {
  kSequential,  ///< Everything in one thread.
  kThreaded,    ///< Features ahead and mapping beside; the same result to the byte.
  kLive,        ///< Frames at the pace of their time stamps; late work is skipped and counted.
};

/// Throws Error for a name other than sequential, threaded and live.
Schedule ParseSchedule(const std::string& name);

/// What sees for the system. The pointers must outlive it.
struct Perception {
  Extractor* extractor = nullptr;
  Matcher* matcher = nullptr;
  const Vocabulary* vocabulary = nullptr;  ///< Null: places are not recognised.
  TurnedDescriber* turned = nullptr;       ///< Null: only under about the same heading.
  /// Looks at places first, so that a slow `matcher` is asked for the best of them only, and for
  /// lost frames only; null: none.
  Matcher* quick_matcher = nullptr;
  bool matcher_is_learned = false;  ///< Then landmarks are created from its matches, too.
  /// Sees photographs of a survey at a part of their size; null: they are not.
  LenslessExtractor* reduced = nullptr;
  /// Asked for photographs of a survey that `matcher` leaves outside of its map; null: none.
  Matcher* learned_matcher = nullptr;
};

/// Tracker, Mapper and LoopCloser wired together. One run an instance.
class Slam {
 public:
  /// Called after each frame, in the calling thread.
  using Progress = std::function<void(const FrameRecord&)>;

  Slam(const Camera& camera, const SystemOptions& options, const Perception& perception);

  /// Starts from maps that are there: the first frames are looked for in them.
  void Load(Atlas atlas);

  /// What other sensors measured meanwhile, on the images' clock: gives the maps their scale, level
  /// and place on Earth at the end of the run.
  void UseSensors(SensorStreams streams) { sensors_ = std::move(streams); }
  /// The same where samples come in beside the images: `streams` is asked once, after the last
  /// image. What images turned by while they were read then comes with them.
  void UseSensorsAtEnd(std::function<SensorStreams()> streams) {
    sensors_at_end_ = std::move(streams);
  }

  /// Leaves out what is seen in this part of the images.
  void LeaveOut(const ImageRegion& region) { image_fixed_.Know(region); }

  /// What was told of a lens that an earlier pass over the images has found: its own are no prior.
  void TellPinhole(const Pinhole& told) { mapper_.TellPinhole(told); }

  /// `observer` (may be null) must outlive the run.
  void Observe(RunObserver* observer);

  /// `due` is asked after each frame; where it says true `take` gets a copy of what there is of the
  /// run, in another thread: the maps as they are and the frames in them, without what they saw.
  void SaveWhenDue(std::function<bool()> due, std::function<void(SlamResult, Atlas)> take) {
    meanwhile_ = {std::move(due), std::move(take)};
  }

  /// Runs over all images. `stop` is asked before each frame, in other threads too while an image
  /// is waited for or the whole map is adjusted; once it says true the run ends as if there were no
  /// more, but for a limit on the time that finishing takes.
  SlamResult Run(ImageSource* images, Schedule schedule, const Progress& progress = nullptr,
                 const std::function<bool()>& stop = nullptr);

  const Atlas& atlas() const { return atlas_; }
  /// Leaves none behind.
  Atlas TakeAtlas() { return std::move(atlas_); }
  /// As given, or refined by Run.
  const Camera& camera() const { return camera_; }

 private:
  void ProcessAll(FrameFeed* feed, MappingLane* mapping, bool live, const Progress& progress,
                  const std::function<bool()>& stop, SlamResult* result);
  TrackingResult Process(const Frame& frame, MappingLane* mapping, bool live);
  void CollectLocalMap(const Frame& frame, MappingLane* mapping, bool live);
  /// The frame's place in any map; nothing where no pose is sure.
  std::optional<TrackingResult> Relocalise(const Frame& frame, MappingLane* mapping);
  PlaceMatchers MatchersOfPlaces();
  std::optional<PlaceMemory> MakePlaces() const;
  LoopCloser* MakeLoopCloser();
  bool StartMap(const InitialMapRequest& request, MappingLane* mapping);
  void FollowInUnchangedMap(TrackingResult* result);
  Frame WithoutWhatIsFixed(const Frame& taken);
  /// From a frame with all its key points.
  void LearnWhatIsFixed(const Frame& frame, const TrackedPose& pose, MappingLane* mapping);
  SlamResult ResultSoFar(const SlamResult& result) const;
  void SaveMeanwhile(MappingLane* mapping, const SlamResult& result);
  /// Has the maps forget what no frame refers to any more, once frames were forgotten.
  void ForgetRemoved(MappingLane* mapping, const SlamResult& result);

  Camera camera_;
  const SystemOptions options_;
  const Perception perception_;
  SharedMatcher matcher_;
  std::optional<SharedMatcher> quick_matcher_;
  StageClock clock_;
  Atlas atlas_;
  Mapper mapper_;
  std::optional<PlaceMemory> places_;  ///< Nothing without a vocabulary.
  std::optional<LoopCloser> loop_closer_;
  BackEnd back_end_;
  Tracker tracker_;
  ImageFixedPoints image_fixed_;
  int64_t keypoints_since_known_ = 0, left_out_keypoints_ = 0;
  LostFrames lost_frames_;
  int relocalisations_ = 0;
  SensorStreams sensors_;
  std::function<SensorStreams()> sensors_at_end_;
  RunObserver* observer_ = nullptr;
  KeyframeId first_new_keyframe_{0};  ///< Those before it came with Load.
  KeyframeId surroundings_of_;  ///< Where the Tracker's local map was made, for localise_only.
  std::optional<FrameId> keyframe_under_way_;
  RemovedForgetter forgetter_;  ///< Used with the atlas.
  struct Meanwhile {
    std::function<bool()> due;
    std::function<void(SlamResult, Atlas)> take;
  } meanwhile_;
};

}  // namespace deepuav
