#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/system/finish/trajectory_finish.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/shutter/image_turns.h"
#include "deepuav/system/shutter/readout_path.h"
#include "deepuav/system/shutter/readout_run.h"

namespace deepuav {

/// Has a map's keyframes and frames move, while a rolling shutter read them, as all images together
/// tell at the end, and adjusts the map to that. Thread-compatible.
class ReadoutFollowing {
 public:
  /// The references must outlive it.
  ReadoutFollowing(const ReadoutPathOptions& path, const ImageTurnOptions& images,
                   const ReadoutSearchOptions& search, const ReadoutRun& run,
                   const TrajectoryFinish& finish)
      : path_(path), images_(images), search_(search), run_(run), finish_(finish) {}

  /// As the path says, but for turns that were measured. False, and nothing changed, where there
  /// are none and images come too rarely to tell. The map is to be adjusted afterwards.
  bool FollowPath(MapId map, const std::function<bool()>& stop,
                  std::vector<FrameRecord>* records) const;
  /// Whether some of the images save about as much, so that it is worth to ask all.
  bool ImagesMayTell(MapId map, double min_saved_share, const std::function<bool()>& stop,
                     const std::vector<FrameRecord>& records) const;
  /// Where the images contradict the turns that are known, and turns of their own save a share of
  /// their errors: as they say, which is returned. The map is to be adjusted afterwards.
  ImageTurns FollowImages(MapId map, double min_saved_share, const std::function<bool()>& stop,
                          std::vector<FrameRecord>* records) const;
  /// Where images told how they turned, of a readout that was assumed: how long it takes, by how
  /// the camera travelled and slowly turned meanwhile. `camera`, map and `turns` follow that.
  /// Nothing where that tells it badly, as of a camera that hovers.
  std::optional<FoundReadout> FindReadout(MapId map, const std::function<bool()>& stop,
                                          std::vector<FrameRecord>* records,
                                          ImageTurns* turns) const;

 private:
  /// By the options, and of so many keyframes.
  bool AreAsked(MapId map) const;
  /// Frames without a pose get one in the map where they can, so that they are asked, too.
  void LocateLost(MapId map, const std::function<bool()>& stop,
                  std::vector<FrameRecord>* records) const;
  ReadoutPath PathOf(MapId map, const std::vector<FrameRecord>& records) const;
  ImageTurns TurnsOf(MapId map, TurnModel model, const std::function<bool()>& stop,
                     const std::vector<FrameRecord>& records) const;
  /// How the camera travels and slowly turns.
  ReadoutPath SlowPathPerS(MapId map, const std::vector<FrameRecord>& records) const;
  void TakeImages(const ImageTurns& turns, MapId map, std::vector<FrameRecord>* records) const;

  const ReadoutPathOptions& path_;
  const ImageTurnOptions& images_;
  const ReadoutSearchOptions& search_;
  const ReadoutRun run_;
  const TrajectoryFinish& finish_;
};

}  // namespace deepuav
