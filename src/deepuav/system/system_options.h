#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/base/options.h"
#include "deepuav/features/image_fixed_votes.h"
#include "deepuav/looping/loop_closer.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/survey/survey_options.h"
#include "deepuav/system/finish/bent_start.h"
#include "deepuav/system/finish/gap_options.h"
#include "deepuav/system/finish/path_smoothing.h"
#include "deepuav/system/sensors/georeferencing.h"
#include "deepuav/system/shutter/image_turns.h"
#include "deepuav/system/shutter/readout_path.h"
#include "deepuav/tracking/tracker.h"

namespace deepuav {

struct SystemOptions {
  int map_delay_frames =
      1;  ///< Offline, the local map of keyframe k is used from exactly this many frames after k.
  int frames_ahead = 2;              ///< Frames that may wait for the Tracker (threaded).
  double min_neighbour_share = 0.7;  ///< Landmarks seen over those of the frame before or after;
                                     ///< less: the frame is located again at the end.
  int max_unlocated_frames =
      600;  ///< Frames without a sure pose whose features are kept to locate them at the end.
  /// First frames of a map that are located again at the end: what they saw may not have lasted.
  int young_map_frames = 30;
  int full_record_frames =
      3000;  ///< Latest frames of which all that they saw is kept to refine their poses at the end.
  int old_record_landmarks = 80;  ///< Kept of what an earlier frame saw.
  int max_records = 0;  ///< Frames remembered at most: beyond, every second one of the older half
                        ///< is forgotten; 0: all are remembered.
  int adjustment_delay_keyframes =
      5;  ///< Offline, a global bundle adjustment after a loop enters so many keyframes later.
  bool adjust_at_end = true;   ///< Global bundle adjustment before the trajectory is finished.
  bool localise_only = false;  ///< Find frames in the loaded maps and leave these as they are.
  bool refine_focal = false;   ///< Nothing but the camera's focal length is in doubt.
  int end_reference_tries =
      12;  ///< Keyframes matched to locate a frame at the end; as tracking.reference_tries.
  int max_gap_frames = 30;  ///< Unlocated frames in a row that the end tries to bridge.
  /// A map that lasts at most so long, between the frames of another, is taken for a part of it
  /// that was not known again.
  double max_brief_s = 15;
  double turned_interval_s =
      0.25;  ///< A lost camera is looked for under other headings at most so often.
  double finish_stopped_s =
      5;                 ///< For adjusting and locating at the end of a run that was stopped.
  PatchOptions patches;  ///< For tracking and mapping.
  TrackingOptions tracking;
  ImageFixedOptions image_fixed;
  MappingOptions mapping;
  LoopingOptions looping;
  SurveyOptions survey;
  GapOptions gaps;
  PathSmoothingOptions smoothing;
  ReadoutPathOptions readout;
  ImageTurnOptions image_turns;
  BentStartOptions bent_start;
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
    visit("young_map_frames", young_map_frames, "",
          "first frames of a map that are located again at the end", Between(0, 1'000'000));
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
          "refine the focal length in it, where nothing else of a calibration is in doubt");
    visit("end_reference_tries", end_reference_tries, "",
          "keyframes matched without prediction to locate a frame at the end", Between(1, 100));
    visit("max_gap_frames", max_gap_frames, "",
          "frames without a pose in a row that are tried at the end", Between(0, 1'000'000));
    visit("max_brief_s", max_brief_s, "s",
          "that a map between the frames of another lasts, up to which they are looked for there",
          Between(0, 1e6));
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

}  // namespace deepuav
