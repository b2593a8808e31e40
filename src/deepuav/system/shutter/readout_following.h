#pragma once

#include <functional>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/system/finish/trajectory_finish.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/shutter/image_turns.h"
#include "deepuav/system/shutter/readout_path.h"

namespace deepuav {

/// Has a map's keyframes and frames move, while a rolling shutter read them, as all images together
/// tell at the end, and adjusts the map to that. Thread-compatible.
class ReadoutFollowing {
 public:
  /// What it works on; all must outlive it.
  struct Run {
    Camera* camera;
    const Atlas* atlas;
    Mapper* mapper;
    KeyframeId first_new_keyframe;  ///< Those before it were loaded.
  };

  ReadoutFollowing(const ReadoutPathOptions& path, const ImageTurnOptions& images, const Run& run,
                   const TrajectoryFinish& finish)
      : path_(path), images_(images), run_(run), finish_(finish) {}

  /// As the path says, but for turns that were measured. False, and nothing changed, where there
  /// are none and images come too rarely to tell. The map is to be adjusted afterwards.
  bool FollowPath(MapId map, const std::function<bool()>& stop,
                  std::vector<FrameRecord>* records) const;
  /// Where the images contradict the turns that are known: as they say, which is returned. The map
  /// is to be adjusted afterwards.
  ImageTurns FollowImages(MapId map, const std::function<bool()>& stop,
                          std::vector<FrameRecord>* records) const;

 private:
  /// Frames without a pose get one in the map where they can, so that they are asked, too.
  void LocateLost(MapId map, const std::function<bool()>& stop,
                  std::vector<FrameRecord>* records) const;
  ReadoutPath PathOf(MapId map, const std::vector<FrameRecord>& records) const;
  ImageTurns TurnsOf(MapId map, TurnModel model, const std::function<bool()>& stop,
                     const std::vector<FrameRecord>& records) const;
  void Take(const ReadoutPath& path, MapId map, std::vector<FrameRecord>* records) const;
  void Adjust(MapId map, const std::function<bool()>& stop) const;

  const ReadoutPathOptions& path_;
  const ImageTurnOptions& images_;
  const Run run_;
  const TrajectoryFinish& finish_;
};

}  // namespace deepuav
