#include "deepuav/assembly/live/live_limits.h"

#include <algorithm>

namespace deepuav {

void BoundRecords(SystemOptions* options) {
  constexpr int kFrames = 10'000;
  constexpr int kFullShare = 10;  // One of so many at most is remembered with all that it saw.
  if (options->max_records == 0) options->max_records = kFrames;
  options->full_record_frames =
      std::min(options->full_record_frames, std::max(1, options->max_records / kFullShare));
}

}  // namespace deepuav
