#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

struct PathGapLimits {
  double max_gap_s = 0;    ///< Without a pose.
  double max_rim_s = 0;    ///< Before and after it, of frames that see few landmarks...
  int firm_landmarks = 0;  ///< ...fewer than this.
};

/// Records of one map in a row, with gaps between them.
struct PathStretch {
  size_t first = 0, last = 0;  ///< Both with poses that hold.
  /// One per record: its pose holds as it is. Not of those without one, nor of those near them that
  /// see few landmarks.
  std::vector<uint8_t> holds;

  size_t size() const { return last - first + 1; }
};

/// The stretches about the gaps that lie between two poses in the same map; those that share frames
/// are one. A pose more on either side tells how the camera moved there.
std::vector<PathStretch> FindPathGaps(const Atlas& atlas, const std::vector<FrameRecord>& records,
                                      const PathGapLimits& limits);

}  // namespace deepuav
