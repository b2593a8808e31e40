#pragma once

#include <functional>
#include <optional>

#include "deepuav/assembly/datasets/sample_calibration.h"
#include "deepuav/capture/live_feed.h"

namespace deepuav {

/// How long a live source is looked at for its lens.
struct LiveLensOptions {
  int images = kSampleImages;
  double interval_s = kSampleIntervalS;  ///< Between two of them, while the picture moves.
  int fewest_images = 20;                ///< With which it is tried when the time is up.
  double longest_s = 60;                 ///< 0: not at all.
};

/// The camera that a source is taken to have, of images as they come, and how well the focal length
/// is known: its standard deviation over it.
struct GuessedLens {
  Camera camera;
  double focal_sigma = 0;
};

/// Who is told of a search for a lens, and may end it.
struct LensHooks {
  std::function<void(const std::string& line)> say;
  std::function<bool()> stop;  ///< Asked in any thread.
};

/// The lens of a live source, found by its first images; those that come meanwhile are left out, as
/// no pose under a wrong lens is of use. Nothing where they do not tell it in time. Throws Error
/// where the source cannot be opened.
std::optional<SampleCalibration> LearnLens(LiveSource* source, const GuessedLens& guess,
                                           const LiveFeedOptions& feed, const RunOptions& run,
                                           const LiveLensOptions& options, const LensHooks& hooks);

}  // namespace deepuav
