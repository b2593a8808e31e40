#pragma once

#include <cstddef>
#include <vector>

#include "deepuav/system/system_options.h"

namespace deepuav {

/// Of each sensor's samples a live run, which may go on for days, keeps so many of the latest for
/// its end: at most half as many again. A day of an inertial sensor's would take a gigabyte; these
/// take 30 MB. At 200 Hz they are the latest half an hour, which covers the frames that are
/// remembered closely enough to be joined by them: the older ones are thinned out.
inline constexpr size_t kLiveSamples = 360'000;

/// Bounds the frames that a live run remembers, where its options leave that open.
void BoundRecords(SystemOptions* options);

/// Forgets the oldest once there are half as many again as `kept`; 0: none ever. Seldom, as those
/// that stay are moved.
template <typename Sample>
void ForgetOldest(size_t kept, std::vector<Sample>* samples) {
  const size_t count = samples->size();
  if (kept == 0 || count <= kept + kept / 2) return;
  const auto first = samples->begin();
  samples->erase(first, first + static_cast<std::ptrdiff_t>(count - kept));
}

}  // namespace deepuav
