#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/map/map.h"
#include "deepuav/mapping/landmarks/patch_observation.h"
#include "deepuav/matching/epipolar.h"

namespace deepuav {

struct CreationOptions {
  int max_neighbours = 10;           ///< Keyframes matched with the new one.
  int learned_neighbours = 0;        ///< Of these, by the learned matcher too, where there is one.
  double min_baseline_ratio = 0.01;  ///< Distance of the cameras over the neighbour's median depth.
  double min_parallax_deg = 1.0;
  double max_chi_square = 5.991;  ///< Squared reprojection error over sigma in either view.
  double max_distance_ratio = 2;  ///< Between the point's distances to the two cameras.
  EpipolarOptions epipolar;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_neighbours", max_neighbours, "",
          "keyframes matched with a new one to create landmarks", Between(1, 1000));
    visit("learned_neighbours", learned_neighbours, "",
          "of these, the most covisible ones that matching.method=superglue matches, too",
          Between(0, 1000));
    visit("min_baseline_ratio", min_baseline_ratio, "",
          "distance of two cameras over the median depth, at least", Between(0, 10));
    visit("min_parallax_deg", min_parallax_deg, "deg", "parallax of a new landmark", Above(0, 90));
    visit("max_chi_square", max_chi_square, "",
          "squared reprojection error over sigma of a new landmark, at most", Above(0, 1e6));
    visit("max_distance_ratio", max_distance_ratio, "",
          "between a new landmark's distances to its cameras, at most", Between(1, 1e6));
  }
};

/// Matches key points of the keyframe that show no landmark yet with those of its covisible
/// keyframes, triangulates, and adds the landmarks that pass: parallax, in front of both cameras,
/// reprojection error in standard deviations, similar distance. Returns them. Matches are nearest
/// neighbours along the epipolar lines; before these the matches that `learned` (may be null) finds
/// there.
std::vector<LandmarkId> CreateLandmarks(Map* map, KeyframeId keyframe, const Pinhole& pinhole,
                                        IdSource* ids, const CreationOptions& options,
                                        const PatchObserver& observer, Matcher* learned = nullptr);

}  // namespace deepuav
