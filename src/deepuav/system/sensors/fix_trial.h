#pragma once

#include "deepuav/estimation/bundle/camera_factors.h"
#include "deepuav/map/map.h"

namespace deepuav {

/// What a keyframe sees of its map from where a fix has it.
struct FixTrial {
  SE3 cam_from_world;     ///< Under which fix and landmarks agree best.
  double fix_sigmas = 0;  ///< It is still off the fix, in standard deviations.
  int agreeing_now = 0;   ///< Landmarks that agree with the keyframe's present pose...
  int agreeing = 0;       ///< ...and with that of the trial.
};

/// Tries a keyframe, landmarks held, where the factor measured it to be. `pinhole` of the
/// keyframe's measurements.
FixTrial TryFix(const Map& map, KeyframeId keyframe, const PositionFactor& fix,
                const Pinhole& pinhole);

}  // namespace deepuav
