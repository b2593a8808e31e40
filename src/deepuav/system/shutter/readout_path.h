#pragma once

#include <map>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/path_in_readout.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_path.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

struct ReadoutPathOptions {
  int rounds = 3;               ///< Of the path telling the motions, and the map adjusted to them.
  double max_missed = 0.75;     ///< TurnsMissed of a path that tells how the camera turns...
  double harmless_rad = 0.002;  ///< ...unless it is less than this, as of one that hardly turns.
  PathInReadoutOptions path;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("rounds", rounds, "",
          "times that the path tells how a camera with a rolling shutter moved while it read its "
          "images, and the map is adjusted to that; 0: as when they came",
          Between(0, 20));
    visit("max_missed", max_missed, "",
          "what the orientations about an image miss its own by, over the turn from image to "
          "image, beyond which they don't tell how the camera turned while it was read",
          Between(0, 100));
    visit("harmless_rad", harmless_rad, "rad",
          "what they may miss it by all the same, which shows in no image", Between(0, 1));
    path.Visit(visit);
  }
};

/// How the camera moved while its images were read, by the whole path: when they came, only what
/// lay before was known.
struct ReadoutPath {
  std::map<Timestamp, ReadoutMotion> motions;  ///< In the map's units as they are now.
  bool tells_turns = true;  ///< Else the images come too rarely, and no turn is taken.
};

ReadoutPath FindReadoutPath(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records,
                            const PoseOfFrame& pose_of_frame, double readout_s,
                            const ReadoutPathOptions& options);

/// Whether turns of the map's frames were measured, by a gyroscope or by the images themselves.
bool HasMeasuredTurns(const Atlas& atlas, MapId map, const std::vector<FrameRecord>& records);

/// Turns that were measured stay as they were, in place of the path's.
void KeepMeasuredTurns(const std::vector<FrameRecord>& records, ReadoutPath* path);

/// Of the keyframes from `first` on.
std::map<KeyframeId, ReadoutMotion> MotionsOfKeyframes(const ReadoutPath& path, const Map& map,
                                                       KeyframeId first);

/// Has the frames that are located in the map move so: what they saw, and key points that are kept,
/// get the places that the middle row would have seen then.
void ChangeMotions(const ReadoutPath& path, const Atlas& atlas, MapId map, const Camera& camera,
                   std::vector<FrameRecord>* records);

}  // namespace deepuav
