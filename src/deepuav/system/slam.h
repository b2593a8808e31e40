#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/base/options.h"
#include "deepuav/features/extractor.h"
#include "deepuav/looping/loop_closer.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/system/back_end.h"
#include "deepuav/system/frame_feed.h"
#include "deepuav/system/frame_record.h"
#include "deepuav/system/gap_options.h"
#include "deepuav/system/georeferencing.h"
#include "deepuav/system/image_source.h"
#include "deepuav/system/inertial_bridge.h"
#include "deepuav/system/inertial_gauge.h"
#include "deepuav/system/map_references.h"
#include "deepuav/system/mapping_lane.h"
#include "deepuav/system/pose_covariances.h"
#include "deepuav/system/record_limits.h"
#include "deepuav/system/run_observer.h"
#include "deepuav/system/shared_matcher.h"
#include "deepuav/system/stage_clock.h"
#include "deepuav/system/trajectory_finish.h"
#include "deepuav/tracking/tracker.h"

namespace deepuav {

enum class Schedule {
  kSequential,  ///< Everything in one thread.
  kThreaded,    ///< Features ahead and mapping beside; the same result to the byte.
  kLive,        ///< Frames at the pace of their time stamps; late work is skipped and counted.
};

/// Throws Error for a name other than sequential, threaded and live.
Schedule ParseSchedule(const std::string& name);

struct SystemOptions {
  int map_delay_frames =
      1;  ///< Offline, the local map of keyframe k is used from exactly this many frames after k.
  int frames_ahead = 2;              ///< Frames that may wait for the Tracker (threaded).
  double min_neighbour_share = 0.7;  ///< Landmarks seen over those of the frame before or after;
                                     ///< less: the frame is located again at the end.
  int max_unlocated_frames =
      600;  ///< Frames without a sure pose whose features are kept to locate them at the end.
  int full_record_frames =
      3000;  ///< Latest frames of which all that they saw is kept to refine their poses at the end.
  int old_record_landmarks = 80;  ///< Kept of what an earlier frame saw.
  int max_records = 0;  ///< Frames remembered at most: beyond, every second one of the older half
                        ///< is forgotten; 0: all are remembered.
  int adjustment_delay_keyframes =
      5;  ///< Offline, a global bundle adjustment after a loop enters so many keyframes later.
  bool adjust_at_end = true;   ///< Global bundle adjustment before the trajectory is finished.
  bool localise_only = false;  ///< Find frames in the loaded maps and leave these as they are.
  bool refine_focal = false;   ///< The camera's focal length is a guess, to be refined then.
  int end_reference_tries =
      12;  ///< Keyframes matched to locate a frame at the end; as tracking.reference_tries.
  int max_gap_frames = 30;  ///< Unlocated frames in a row that the end tries to bridge.
  double turned_interval_s =
      0.25;  ///< A lost camera is looked for under other headings at most so often.
  double finish_stopped_s =
      5;                 ///< For adjusting and locating at the end of a run that was stopped.
  PatchOptions patches;  ///< For tracking and mapping.
  TrackingOptions tracking;
  MappingOptions mapping;
  LoopingOptions looping;
  SurveyOptions survey;
  GapOptions gaps;
  SensorUseOptions sensors;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("map_delay_frames", map_delay_frames, "",
          "frames after a keyframe from which its local map is used", Between(1, 1000));
    visit("frames_ahead", frames_ahead, "", "frames that may wait for the Tracker",
          Between(1, 100));
    visit("min_neighbour_share", min_neighbour_share, "",
          "landmarks seen over those of a neighbouring frame, below which a frame is located again "
          "at the end",
          Between(0, 1));
    visit("max_unlocated_frames", max_unlocated_frames, "",
          "frames without a sure pose that are kept to locate at the end", Between(0, 1'000'000));
    visit("full_record_frames", full_record_frames, "",
          "latest frames of which all landmarks seen are kept to refine their poses at the end",
          Between(0, 100'000'000));
    visit("old_record_landmarks", old_record_landmarks, "", "of these, kept of an earlier frame",
          Between(0, 1'000'000));
    visit(
        "max_records", max_records, "",
        "frames remembered at most, beyond which every second one of the older half is forgotten; "
        "0: all are remembered",
        Between(0, 100'000'000));
    visit("adjustment_delay_keyframes", adjustment_delay_keyframes, "",
          "keyframes after a closed loop until the whole map is adjusted", Between(1, 1'000'000));
    visit("adjust_at_end", adjust_at_end, "", "global bundle adjustment at the end");
    visit("localise_only", localise_only, "",
          "find frames in the loaded maps and leave these as they are");
    visit("refine_focal", refine_focal, "",
          "refine the focal length in it: for calibrations that are a guess");
    visit("end_reference_tries", end_reference_tries, "",
          "keyframes matched without prediction to locate a frame at the end", Between(1, 100));
    visit("max_gap_frames", max_gap_frames, "",
          "frames without a pose in a row that are tried at the end", Between(0, 1'000'000));
    visit("turned_interval_s", turned_interval_s, "s",
          "between two times that a lost camera is looked for under other headings, which costs "
          "three runs of the network",
          Between(0, 1e6));
    visit("finish_stopped_s", finish_stopped_s, "s",
          "time for the last adjustment and for locating frames after a run was stopped",
          Between(0, 3600));
  }
};

/// Registers the options of the system and all its parts under their names.
void RegisterOptions(SystemOptions* options, OptionRegistry* registry);

/// What a run leaves behind.
struct SlamResult {
  std::vector<FrameRecord> frames;
  std::map<std::string, std::vector<double>> stage_durations_s;
  int skipped_late = 0;          ///< Images left out by the live schedule.
  int64_t forgotten_frames = 0;  ///< Not in `frames` any more: SystemOptions::max_records.
  int relocalisations = 0, closed_loops = 0, merged_maps = 0;
  int maps_joined_by_imu = 0;
  int64_t landmarks_set_aside = 0;  ///< Removed, as they seemed to lie on things that move.
  std::map<MapId, InertialAttempt> inertial;          ///< Of each map, where there were samples.
  std::map<MapId, GeoreferenceReport> georeferences;  ///< Of each map, where there were fixes.
  MapCovariances covariances;                         ///< Of the keyframes, in the end.
  std::optional<CalibrationSigmas> lens;              ///< Where the images corrected it.
  int doubtful_photographs = 0;                       ///< Of a survey: SurveyOutcome::doubtful.
  std::string
      failure;  ///< What ended the run early, if anything did; the result until then is complete.
  bool stopped = false;  ///< By `stop`: before the last image, or in what follows it.
};

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
  FrameRecord Process(const Frame& frame, MappingLane* mapping, bool live);
  void CollectLocalMap(const Frame& frame, MappingLane* mapping, bool live);
  /// The frame's place in any map; nothing where no pose is sure.
  std::optional<TrackingResult> Relocalise(const Frame& frame, MappingLane* mapping);
  std::optional<TrackingResult> RelocaliseUnder(const Frame& frame,
                                                std::span<const Descriptors> turned);
  /// Whether it is time to look for a lost camera under other headings again.
  bool TurnsAt(Timestamp time);
  PlaceMatchers MatchersOfPlaces();
  std::optional<PlaceMemory> MakePlaces() const;
  LoopCloser* MakeLoopCloser();
  bool StartMap(const InitialMapRequest& request, MappingLane* mapping);
  void FollowInUnchangedMap(TrackingResult* result);
  SlamResult ResultSoFar(const SlamResult& result) const;
  void SaveMeanwhile(MappingLane* mapping, const SlamResult& result);
  /// Has the maps forget what no frame refers to any more, once frames were forgotten.
  void ForgetRemoved(MappingLane* mapping, const SlamResult& result);
  void AdjustAll(const std::function<bool()>& stop, SlamResult* result);
  /// A guess is refined otherwise, and loaded maps were made with the calibration as it is.
  bool MayCorrectCalibration() const;
  /// Whether the adjustment at the end refines the focal length: with the largest map.
  bool RefinesFocalIn(MapId map) const;
  void MakeMetricAll(const std::function<bool()>& stop, SlamResult* result);
  /// Over what the camera did not see, by the inertial sensor: what lies between is for the end.
  std::vector<ReckonedFrame> BridgeByImu(SlamResult* result);
  void GeoreferenceAll(const std::function<bool()>& stop, SlamResult* result);
  /// Adjusts the maps and gives all frames their final poses; what fails is left out.
  void Finish(const std::function<bool()>& asked_to_stop, SlamResult* result);
  TrajectoryFinish MakeFinish(FrameLocator* locator) const;
  void SetAsideMoving();
  void EstimateCovariances(const std::function<bool()>& stop, SlamResult* result);
  void FinishTrajectory(const std::function<bool()>& stop, std::vector<FrameRecord>* records);
  void BridgeGaps(const std::function<bool()>& stop,
                  std::vector<std::shared_ptr<const Features>> features,
                  std::vector<FrameRecord>* records);

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
  Relocaliser relocaliser_;
  int relocalisations_ = 0;
  SensorStreams sensors_;
  std::function<SensorStreams()> sensors_at_end_;
  RunObserver* observer_ = nullptr;
  std::optional<Timestamp> turned_at_;  ///< When a lost camera was last looked for turned.
  KeyframeId first_new_keyframe_{0};    ///< Those before it came with Load.
  KeyframeId surroundings_of_;  ///< Where the Tracker's local map was made, for localise_only.
  std::optional<FrameId> keyframe_under_way_;
  RemovedForgetter forgetter_;  ///< Used with the atlas.
  struct Meanwhile {
    std::function<bool()> due;
    std::function<void(SlamResult, Atlas)> take;
  } meanwhile_;
};

}  // namespace deepuav
