#pragma once

#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "deepuav/sensors/streams.h"
#include "deepuav/system/frames/frame_path.h"
#include "deepuav/system/frames/frame_record.h"
#include "deepuav/system/shutter/readout_path.h"
#include "deepuav/system/shutter/readout_run.h"

namespace deepuav {

/// Finds how long the camera takes to read an image, of which nobody has told, from a map that was
/// adjusted, and puts it into `camera`: keyframes and frames then move as the path says while they
/// are read, and the map is adjusted to that, round by round. Nothing, and all as it was, where the
/// map does not tell it, or the camera reads all rows at once. Where there is a gyroscope whose
/// mount is known it is asked first; one whose clock is off fits no readout. Thread-compatible.
class ReadoutFinding {
 public:
  /// The references must outlive it. `imu` may be empty; `max_imu_gap_s`: between samples that are
  /// interpolated.
  ReadoutFinding(const ReadoutPathOptions& options, const ReadoutSearchOptions& search,
                 const ReadoutRun& run, const ImuStream& imu, double max_imu_gap_s,
                 PoseOfFrame pose_of_frame)
      : options_(options),
        search_(search),
        run_(run),
        imu_(imu),
        max_imu_gap_s_(max_imu_gap_s),
        pose_of_frame_(std::move(pose_of_frame)) {}

  std::optional<FoundReadout> FindIn(MapId map, const std::function<bool()>& stop,
                                     std::vector<FrameRecord>* records) const;

 private:
  /// How images turned while they were read.
  enum class TurnsBy { kGyroscope, kPath };

  std::optional<FoundReadout> FindBy(TurnsBy source, MapId map, const std::function<bool()>& stop,
                                     std::vector<FrameRecord>* records) const;
  ReadoutPath PathPerS(TurnsBy source, MapId map, const std::vector<FrameRecord>& records) const;

  const ReadoutPathOptions& options_;
  const ReadoutSearchOptions& search_;
  const ReadoutRun run_;
  const ImuStream& imu_;
  const double max_imu_gap_s_;
  const PoseOfFrame pose_of_frame_;
};

}  // namespace deepuav
