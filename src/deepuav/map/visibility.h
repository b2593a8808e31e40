#pragma once

#include <optional>

#include "deepuav/base/option_bounds.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/map/local_map.h"
#include "deepuav/map/map.h"

namespace deepuav {

struct VisibilityOptions {
  double max_view_angle_deg = 60;
  double max_distance_factor = 2;

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_view_angle_deg", max_view_angle_deg, "deg",
          "between the view and a landmark's mean viewing direction", Within(0, 90));
    visit("max_distance_factor", max_distance_factor, "",
          "beyond the distances a landmark was seen from", Between(1, 1e6));
  }
};

/// The undistorted pixel at which a camera should see the landmark; nothing when it lies outside
/// the image, or would look too different from there to be recognised.
std::optional<Eigen::Vector2d> ExpectedPixel(const LocalLandmark& landmark,
                                             const SE3& cam_from_world, const Camera& camera,
                                             const VisibilityOptions& options);
std::optional<Eigen::Vector2d> ExpectedPixel(const Landmark& landmark, const SE3& cam_from_world,
                                             const Camera& camera,
                                             const VisibilityOptions& options);

}  // namespace deepuav
