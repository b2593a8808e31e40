#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/image_region.h"
#include "deepuav/map/map.h"
#include "deepuav/mapping/landmarks/hovering_landmarks.h"

namespace deepuav {

/// What tells a landmark on something that moves: views of it agree on a point that is not there.
struct MovingLandmarkOptions {
  bool set_aside = true;
  int few_observations = 3;       ///< No more than these may have agreed by chance.
  int few_hovering = 6;           ///< Nor these, of what hovers above the ground.
  double min_found_ratio = 0.25;  ///< Frames that found a landmark over those that should have.
  double max_depth_step = 0.15;   ///< Logarithm of a landmark's depth over that of one around it.
  double min_patch_share = 0.4;   ///< Of a map's observations, measured by patches; fewer tell
                                  ///< nothing of those that are not.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("set_aside", set_aside, "", "remove landmarks that seem to lie on things that move");
    visit("few_observations", few_observations, "", "observations that may agree by chance",
          Between(0, 1000));
    visit("few_hovering", few_hovering, "",
          "observations of what hovers above the ground that may agree by chance",
          Between(0, 1000));
    visit("min_found_ratio", min_found_ratio, "",
          "frames that found a landmark without patches over those that should have",
          Between(0, 1));
    visit("max_depth_step", max_depth_step, "",
          "logarithm of the ratio of a landmark's depth to the most similar around it",
          Above(0, 100));
    visit("min_patch_share", min_patch_share, "",
          "share of observations measured by patches from which their absence tells something",
          Between(0, 1));
  }
};

/// Removes the landmarks of a map that seem to lie on something that moves, and returns how many
/// they were. Views of such a thing agree on a false depth, so that
/// - its patches, warped as that depth predicts, never fit, and most frames, once it or the camera
///   moves otherwise, do not find it where they should, or it was seen too few times to tell;
/// - or, seen few times, it lies nearer or farther than everything around it in the image;
/// - or, seen not often, it hovers above the ground: what stands there stays in view.
int RemoveMoving(Map* map, const MovingLandmarkOptions& options, const HoveringOptions& hovering);

/// Removes what keyframes observe in this part of their images, and landmarks that nothing is left
/// of.
void RemoveObservationsIn(const ImageRegion& region, Map* map);

}  // namespace deepuav
