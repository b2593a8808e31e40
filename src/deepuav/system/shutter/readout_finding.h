#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "deepuav/mapping/mapper.h"
#include "deepuav/sensors/streams.h"
#include "deepuav/system/frames/frame_path.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/shutter/readout_path.h"

namespace deepuav {

/// Finds how long the camera takes to read an image, of which nobody has told, from a map that was
/// adjusted, and puts it into `camera`: keyframes and frames then move as the path says while they
/// are read, and the map is adjusted to that, round by round. Nothing, and all as it was, where the
/// map does not tell it, or the camera reads all rows at once. Where there is a gyroscope whose
/// mount is known it is asked first; one whose clock is off fits no readout. Thread-compatible.
class ReadoutFinding {
 public:
  /// What it works on; all must outlive it.
  struct Run {
    Camera* camera;
    const Atlas* atlas;
    Mapper* mapper;
    const ImuStream& imu;           ///< May be empty.
    double max_imu_gap_s;           ///< Between samples that are interpolated.
    KeyframeId first_new_keyframe;  ///< Those before it were loaded.
  };

  ReadoutFinding(const ReadoutPathOptions& options, const ReadoutSearchOptions& search,
                 const Run& run, PoseOfFrame pose_of_frame)
      : options_(options), search_(search), run_(run), pose_of_frame_(std::move(pose_of_frame)) {}

  std::optional<FoundReadout> FindIn(MapId map, const std::function<bool()>& stop,
                                     std::vector<FrameRecord>* records) const;

 private:
  /// How images turned while they were read.
  enum class TurnsBy { kGyroscope, kPath };

  std::optional<FoundReadout> FindBy(TurnsBy source, MapId map, const std::function<bool()>& stop,
                                     std::vector<FrameRecord>* records) const;
  ReadoutPath PathPerS(TurnsBy source, MapId map, const std::vector<FrameRecord>& records) const;
  /// Has everything move as in this readout.
  void Take(double readout_s, ReadoutPath path_per_s, MapId map,
            std::vector<FrameRecord>* records) const;

  const ReadoutPathOptions& options_;
  const ReadoutSearchOptions& search_;
  const Run run_;
  const PoseOfFrame pose_of_frame_;
};

}  // namespace deepuav
