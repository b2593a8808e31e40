#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/features/image_region.h"
#include "deepuav/mapping/camera/lens_search.h"
#include "deepuav/mapping/camera/readout_search.h"
#include "deepuav/system/finish/pose_covariances.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/sensors/georeferencing.h"
#include "deepuav/system/sensors/inertial_gauge.h"

namespace deepuav {

/// What a run leaves behind.
struct SlamResult {
  std::vector<FrameRecord> frames;
  std::map<std::string, std::vector<double>> stage_durations_s;
  int skipped_late = 0;          ///< Images left out by the live schedule.
  int64_t forgotten_frames = 0;  ///< Not in `frames` any more: SystemOptions::max_records.
  int relocalisations = 0, closed_loops = 0, merged_maps = 0;
  int maps_joined_by_imu = 0, maps_joined_by_fixes = 0;
  int maps_given_up = 0;            ///< As all their frames found a place in another: BriefMaps.
  int64_t landmarks_set_aside = 0;  ///< Removed, as they seemed to lie on things that move.
  ImageRegion image_fixed;  ///< Where the image shows what is fixed to the camera, at the end.
  double image_fixed_keypoint_share = 0;      ///< Of the key points, since that was known, in 0..1.
  std::map<MapId, InertialAttempt> inertial;  ///< Of each map, where there were samples.
  std::map<MapId, GeoreferenceReport> georeferences;  ///< Of each map, where there were fixes.
  MapCovariances covariances;                         ///< Of the keyframes, in the end.
  std::optional<CalibrationSigmas> lens;              ///< Where the images corrected it...
  double lens_shift_px = 0;                           ///< ...by so much, in the mean of the image.
  std::optional<FocalDoubt> focal_doubt;  ///< Where one was told that the largest map contradicts.
  std::optional<FoundReadout> readout;    ///< Where nobody told it and the images do.
  /// How the camera turned while its rolling shutter read each image, where only the images tell.
  std::map<Timestamp, ReadoutMotion> image_turns;
  double image_turns_saved_share = 0;  ///< ImageTurns::saved_share, before these were known.
  int doubtful_photographs = 0;        ///< Of a survey: SurveyOutcome::doubtful.
  std::string
      failure;  ///< What ended the run early, if anything did; the result until then is complete.
  bool stopped = false;  ///< By `stop`: before the last image, or in what follows it.
  bool ended_early() const { return stopped || !failure.empty(); }
};

}  // namespace deepuav
