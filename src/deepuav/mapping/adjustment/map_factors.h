#pragma once

#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/estimation/bundle/camera_factors.h"
#include "deepuav/mapping/adjustment/bundle_window.h"

namespace deepuav {

/// What other sensors say of the keyframes of a map; the factors' cameras are not yet filled in.
struct MapFactors {
  template <typename Factor>
  struct OfKeyframe {
    KeyframeId keyframe;
    Factor factor;
  };
  template <typename Factor>
  struct OfTwo {
    KeyframeId first, second;
    Factor factor;
  };
  std::vector<OfKeyframe<PositionFactor>> positions;
  std::vector<OfTwo<HeightStepFactor>> height_steps;
  std::vector<OfKeyframe<LevelFactor>> levels;
  std::vector<OfTwo<DistanceFactor>> distances;
};

/// Puts the factors of the window's keyframes into its problem. Measured positions hold the gauge:
/// with them no camera is fixed.
void AddFactors(const MapFactors& factors, BundleWindow* window);

/// Moves the window's keyframes to their adjusted poses, each with the growth of the distances to
/// its landmarks as the growth of its scale: what measures metres changes the scale of one part of
/// a map against another. To be called before the landmarks are moved.
void MoveWithScale(const BundleWindow& window, Map* map);

}  // namespace deepuav
