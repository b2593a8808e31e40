#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "deepuav/inertial/alignment/inertial_alignment.h"
#include "deepuav/map/atlas.h"
#include "deepuav/mapping/mapper.h"
#include "deepuav/system/frames/frame_path.h"

namespace deepuav {

/// Gives maps metres and a level at the end of a run, where an inertial sensor and the path of the
/// frames tell both.
class InertialGauge {
 public:
  /// All must outlive it. `pose_of_frame`: the best that is known of frames that are no keyframes.
  InertialGauge(const ImuStream& imu, const InertialOptions& options, PoseOfFrame pose_of_frame,
                Mapper* mapper, Atlas* atlas);

  /// Of one map; `records` are of all frames.
  InertialAttempt Apply(MapId map, const std::vector<FrameRecord>& records,
                        const std::function<bool()>& stop);

  /// The same, one after another, for all of these maps that have no metres yet: by an earlier run.
  std::map<MapId, InertialAttempt> ApplyToAll(const std::vector<MapId>& maps,
                                              const std::vector<FrameRecord>& records,
                                              const std::function<bool()>& stop);

 private:
  const ImuStream& imu_;
  const InertialOptions options_;
  const PoseOfFrame pose_of_frame_;
  Mapper* mapper_;
  Atlas* atlas_;
};

}  // namespace deepuav
