#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/matching/matcher.h"

namespace deepuav {

struct EpipolarOptions {
  double max_distance_px = 2;    ///< From the epipolar line.
  double min_similarity = 0.75;  ///< Cosine.
  double ratio = 0.95;  ///< As in NearestNeighbourOptions, among the candidates near the line.
  double min_epipole_distance_px = 10;  ///< Points nearer to the epipole have no parallax.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_distance_px", max_distance_px, "px", "distance of a match from the epipolar line",
          Above(0, 1000));
    visit("min_similarity", min_similarity, "", "least cosine similarity of a match", Below(-1, 1));
    visit("ratio", ratio, "",
          "distance to the best over distance to the second best near the line, at most",
          Above(0, 1));
    visit("min_epipole_distance_px", min_epipole_distance_px, "px",
          "points nearer to the epipole are left out", Between(0, 100'000));
  }
};

/// The matrix with b^T F a = 0 for homogeneous pixels of one point in views a and b.
Eigen::Matrix3d FundamentalFromPose(const Pinhole& pinhole, const SE3& b_from_a);

/// Those of `matches` that lie near the epipolar line, and not near the epipole, in b.
std::vector<Match> KeepEpipolar(const std::vector<Match>& matches, const Features& a,
                                const Features& b, const Pinhole& pinhole, const SE3& b_from_a,
                                const EpipolarOptions& options);

/// Mutual nearest neighbours among the given key points of two views with known relative pose, near
/// the epipolar line. Matches by rising `a`.
std::vector<Match> MatchEpipolar(const Features& a, const std::vector<int>& keypoints_a,
                                 const Features& b, const std::vector<int>& keypoints_b,
                                 const Pinhole& pinhole, const SE3& b_from_a,
                                 const EpipolarOptions& options);

}  // namespace deepuav
