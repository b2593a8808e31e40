#pragma once

#include <vector>

#include "deepuav/estimation/two_views/two_view.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/map/frame.h"
#include "deepuav/matching/matcher.h"
#include "deepuav/patches/patch_alignment.h"

namespace deepuav {

/// Where two frames show the same, as detected.
std::vector<PixelPair> DetectedPairs(const Frame& a, const Frame& b,
                                     const std::vector<Match>& matches);

struct PairNoise {
  double detected_sigma_px = 0.3;  ///< Of the detector's pixels.
  /// Of how the camera turned while a rolling shutter read either image, where no gyroscope
  /// measured it: what rows far from the middle show is off by it.
  double turn_sigma_rad_s = 0;
};

/// Moves the detected `pairs`, one a match, to where `b` shows what `a` shows at its key points: by
/// patches, warped as the matches around change from one frame to the other, as no pose is known. A
/// match whose patches do not tell, and all of frames whose images are not kept, stay where the
/// detector saw them.
void MeasurePairs(const Frame& a, const Frame& b, const std::vector<Match>& matches,
                  const Camera& camera, const PatchOptions& options, const PairNoise& noise,
                  std::vector<PixelPair>* pairs);

}  // namespace deepuav
