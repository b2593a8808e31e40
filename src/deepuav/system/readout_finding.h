#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/system/frame_path.h"
#include "deepuav/system/frame_record.h"
#include "deepuav/system/readout_path.h"

namespace deepuav {

/// Finds how long the camera takes to read an image, of which nobody has told, from a map that was
/// adjusted, and puts it into `camera`: keyframes and frames then move as the path says while they
/// are read, and the map is adjusted to that, round by round. Nothing, and all as it was, where the
/// map does not tell it, or the camera reads all rows at once.
class ReadoutFinding {
 public:
  /// What it works on; all must outlive it.
  struct Run {
    Camera* camera;
    const Atlas* atlas;
    Mapper* mapper;
    KeyframeId first_new_keyframe;  ///< Those before it were loaded.
  };

  ReadoutFinding(const ReadoutPathOptions& options, const ReadoutSearchOptions& search,
                 const Run& run, PoseOfFrame pose_of_frame)
      : options_(options), search_(search), run_(run), pose_of_frame_(std::move(pose_of_frame)) {}

  std::optional<FoundReadout> FindIn(MapId map, const std::function<bool()>& stop,
                                     std::vector<FrameRecord>* records) const;

 private:
  /// Has everything move as in this readout.
  void Take(double readout_s, ReadoutPath path_per_s, MapId map,
            std::vector<FrameRecord>* records) const;

  const ReadoutPathOptions& options_;
  const ReadoutSearchOptions& search_;
  const Run run_;
  const PoseOfFrame pose_of_frame_;
};

}  // namespace deepuav
