#pragma once

#include <functional>
#include <optional>

#include "deepuav/assembly/sample_calibration.h"
#include "deepuav/capture/live_feed.h"

namespace deepuav {

/// How long a live source is looked at for its lens.
struct LiveLensOptions {
  int images = kSampleImages;
  double interval_s = kSampleIntervalS;  ///< Between two of them, while the picture moves.
  int fewest_images = 20;                ///< With which it is tried when the time is up.
  double longest_s = 60;                 ///< 0: not at all.
};

/// The lens of a live source, found by its first images; those that come meanwhile are left out, as
/// no pose under a wrong lens is of use. `guess` is the source's camera as images come. Nothing
/// where they do not tell it in time. `say` is told what goes on. Throws Error where the source
/// cannot be opened.
std::optional<SampleCalibration> LearnLens(LiveSource* source, const Camera& guess,
                                           double focal_sigma, const LiveFeedOptions& feed,
                                           const RunOptions& run, const LiveLensOptions& options,
                                           const std::function<void(const std::string&)>& say,
                                           const std::function<bool()>& stop);

}  // namespace deepuav
