#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/map/map.h"
#include "deepuav/map/visibility.h"
#include "deepuav/mapping/landmarks/patch_observation.h"
#include "deepuav/matching/projection.h"

namespace deepuav {

struct FusionOptions {
  int second_ring = 5;      ///< Keyframes taken of each neighbour's own neighbours.
  double radius_px = 3;     ///< Search window around a projected landmark.
  int max_neighbours = 15;  ///< Keyframes fused with the new one, and as many of theirs again.
  VisibilityOptions visibility;
  ProjectionOptions projection{0.75, 1.0};

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("second_ring", second_ring, "", "keyframes taken of each neighbour's own neighbours",
          Between(0, 1000));
    visit("radius_px", radius_px, "px", "search window around a projected landmark",
          Above(0, 1000));
    visit("max_neighbours", max_neighbours, "",
          "keyframes whose landmarks are fused with the new one's", Between(1, 1000));
    visit.Part("visibility", visibility);
    visit.Part("projection", projection);
  }
};

/// Finds the landmarks of neighbouring keyframes in this one and the other way round: adds the
/// missing observations and merges landmarks that turn out to be one (Mur-Artal 2015, section
/// VI-C).
void FuseDuplicates(Map* map, KeyframeId keyframe, const Camera& camera,
                    const FusionOptions& options, const PatchObserver& observer);

}  // namespace deepuav
