#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/system/finish/brief_maps.h"
#include "deepuav/system/finish/trajectory_finish.h"
#include "deepuav/system/sensors/inertial_bridge.h"
#include "deepuav/system/shutter/readout_following.h"
#include "deepuav/system/slam_result.h"
#include "deepuav/system/system_options.h"
#include "deepuav/system/watching/stage_clock.h"

namespace deepuav {

/// What follows the last image: the maps are adjusted, get their metres and their place on Earth,
/// and all frames their final poses.
class RunFinish {
 public:
  /// What a run leaves to be finished; all must outlive the finish.
  struct Run {
    Camera* camera;  ///< Corrected where the maps tell.
    Atlas* atlas;
    Mapper* mapper;
    Matcher* matcher;
    StageClock* clock;
    const SensorStreams& sensors;
    KeyframeId first_new_keyframe;  ///< Those before it were loaded.
  };

  /// The options must outlive it.
  RunFinish(const SystemOptions& options, const Run& run) : options_(options), run_(run) {}

  /// What fails is left out and said in `result`. Once `asked_to_stop` (may be null) says true
  /// there are SystemOptions::finish_stopped_s left.
  void Finish(const std::function<bool()>& asked_to_stop, SlamResult* result) const;

 private:
  using Stop = std::function<bool()>;

  void AdjustAll(const Stop& stop, SlamResult* result) const;
  /// Where a rolling shutter read the images: all together tell how the camera moved meanwhile, and
  /// where these may be asked, each of its own turn.
  void FollowReadouts(MapId map, bool ask_images, const Stop& stop, SlamResult* result) const;
  /// Whether what some of them tell makes it worth to ask all.
  bool ImagesMayTell(MapId map, double min_saved_share, const Stop& stop,
                     const std::vector<FrameRecord>& frames) const;
  /// What they tell that their path does not.
  ImageTurns AskImages(MapId map, double min_saved_share, const Stop& stop,
                       SlamResult* result) const;
  void KeepTurns(const ImageTurns& turns, MapId map, SlamResult* result) const;
  ReadoutRun MakeReadoutRun() const;
  ReadoutFollowing MakeReadoutFollowing(const TrajectoryFinish& finish) const;
  /// Gives first keyframes of a map the poses that what came later tells, and adjusts it then.
  void StraightenStart(MapId map, bool ask_images, const Stop& stop, SlamResult* result) const;
  /// Whether the readout is to be found: by the path, before images are asked of their own turns.
  bool SeeksReadout() const;
  /// Where the camera's readout is not told, the largest map may.
  void FindReadoutIn(MapId map, const Stop& stop, SlamResult* result) const;
  /// Where the path does not tell it, images that turned while they were read may.
  void FindReadoutByImages(MapId map, const Stop& stop, SlamResult* result) const;
  /// Of images that told their turns; adjusts the map.
  void RefineReadoutByImages(MapId map, ImageTurns turns, const Stop& stop,
                             SlamResult* result) const;
  /// Loaded maps were made with the calibration as it is.
  bool MayCorrectCalibration() const;
  /// Corrects what the largest map may correct of it, unless that contradicts the focal length.
  void CheckCalibration(MapId map, const Stop& stop, SlamResult* result) const;
  /// Of a guess, where the images tell nothing of the lens.
  bool FixesMayTellFocalIn(MapId map) const;
  /// Whether the adjustment refines the focal length: with the largest map.
  bool RefinesFocalIn(MapId map) const;
  void MakeMetricAll(const Stop& stop, SlamResult* result) const;
  /// Over what the camera did not see, by the inertial sensor: what lies between is for the end.
  std::vector<ReckonedFrame> BridgeByImu(BriefMaps* brief, SlamResult* result) const;
  void GeoreferenceAll(const Stop& stop, SlamResult* result) const;
  TrajectoryFinish MakeTrajectoryFinish(FrameLocator* locator) const;
  FrameLocator MakeThoroughLocator() const;
  /// Before anything is asked of the path as a whole.
  void LocateDoubtful(const Stop& stop, std::vector<FrameRecord>* records) const;
  void FinishTrajectory(const Stop& stop, std::vector<FrameRecord>* records) const;
  /// How many brief maps are given up.
  int RestoreBrief(BriefMaps* brief, const Stop& stop, std::vector<FrameRecord>* records) const;
  void EstimateCovariances(const Stop& stop, SlamResult* result) const;
  void BridgeGaps(const Stop& stop, std::vector<std::shared_ptr<const Features>> features,
                  std::vector<FrameRecord>* records) const;
  void SetAsideMoving() const;
  /// Whether the maps may be changed.
  bool Adjusts() const { return options_.adjust_at_end && !options_.localise_only; }

  const SystemOptions& options_;
  const Run run_;
};

}  // namespace deepuav
