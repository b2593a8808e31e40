#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

struct SurfaceNormalOptions {
  bool enabled = true;               ///< Else each surface faces those that see it.
  int neighbours = 12;               ///< Points around that a plane is laid through.
  double max_distance_px = 100;      ///< To these, in the image.
  double slope_sigma = 1;            ///< Standard deviation of a surface's slope from the one that
                                     ///< faces the camera, before any point tells.
  double min_relative_noise = 1e-3;  ///< Of a point's inverse depth, at least.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("enabled", enabled, "",
          "warp patches by the surface through the landmarks around, not by one that faces the "
          "camera");
    visit("neighbours", neighbours, "", "landmarks around that a surface is laid through",
          Between(3, 1000));
    visit("max_distance_px", max_distance_px, "px", "to these, in the image", Above(0, 10'000));
    visit("slope_sigma", slope_sigma, "",
          "standard deviation of a surface's slope from the one that faces the camera",
          Above(0, 100));
    visit("min_relative_noise", min_relative_noise, "",
          "standard deviation of an inverse depth over it, at least", Within(0, 1));
  }
};

/// A point as a camera sees it.
struct SurfacePoint {
  Eigen::Vector2d direction;  ///< x and y where z is 1.
  double inverse_depth = 0;
  double sigma = 0;  ///< Standard deviation of the inverse depth.
};

/// The point as a camera of that focal length sees it; nothing behind the camera. `noise`:
/// covariance of where it is, by pixels that were taken to be of a focal length of 1.
std::optional<SurfacePoint> SeenBy(const SE3& cam_from_world, const Eigen::Vector3d& point_world,
                                   const Eigen::Matrix3d& noise, double focal_px);

/// The surface that one camera sees, by the points on it. A plane's inverse depth is linear in the
/// image, so each normal is a linear fit, robust (Cauchy weights by the median of the errors) as
/// some of the points around lie on something else. Immutable.
class SurfaceNormals {
 public:
  SurfaceNormals(std::vector<SurfacePoint> points, double focal_px,
                 const SurfaceNormalOptions& options);

  /// Of the surface at a point, of length 1, towards the camera. Where no others lie around it
  /// faces the camera.
  Eigen::Vector3d At(const SurfacePoint& point) const;

 private:
  std::vector<const SurfacePoint*> Around(const Eigen::Vector2d& direction) const;

  std::vector<SurfacePoint> points_;
  double focal_px_;
  SurfaceNormalOptions options_;
};

}  // namespace deepuav
