#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

enum class Relation { kSamePlace, kBetween, kOtherPlace };

/// When two views show the same place.
struct OverlapBounds {
  double same_place = 0.5;  ///< From this overlap on they do.
  double noticeable = 0.1;  ///< Below it they show different places.
  double depth_m = 2;       ///< Usual distance of what is seen.
};

/// Tells how much two views share. With true poses: of points on a grid over one image, at several
/// depths, the fraction that the other sees, the smaller of both ways. With positions alone
/// (photographs straight down, heading unknown): the overlap of two discs, as wide as the image's
/// shorter side shows at the usual depth.
class OverlapJudge {
 public:
  OverlapJudge(const Camera& camera, bool has_orientation, const OverlapBounds& bounds);

  Relation Judge(const SE3& world_from_a, const SE3& world_from_b) const;

 private:
  /// Of what one view shows, the fraction that the other sees.
  double SeenBy(const SE3& world_from_a, const SE3& world_from_b) const;
  /// Of two equal discs, the fraction of one that lies in the other.
  double DiscOverlap(double distance_m) const;

  const Camera camera_;
  const bool has_orientation_;
  const double least_overlap_, least_noticeable_, depth_m_;
  std::vector<Eigen::Vector3d> points_cam_;
};

}  // namespace deepuav
