#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/features/keypoint_grid.h"
#include "deepuav/matching/matcher.h"

namespace deepuav {

/// Where something known by its descriptor is expected in an image.
struct ProjectionTarget {
  Eigen::Vector2d px;
  double radius_px = 0;
  int descriptor = 0;  ///< Row of the target descriptors.
};

struct ProjectionOptions {
  double min_similarity = 0.65;  ///< Cosine.
  double ratio = 0.95;  ///< As in NearestNeighbourOptions, among the candidates in the window.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_similarity", min_similarity, "", "least cosine similarity of a match", Below(-1, 1));
    visit("ratio", ratio, "",
          "distance to the best over distance to the second best in the window, at most",
          Above(0, 1));
  }
};

/// Matches targets (a) to the key points (b) in their windows; a key point goes to the target most
/// like it.
std::vector<Match> MatchProjected(const std::vector<ProjectionTarget>& targets,
                                  const Descriptors& target_descriptors, const Features& features,
                                  const KeypointGrid& grid, const ProjectionOptions& options);

}  // namespace deepuav
