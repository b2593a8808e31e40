#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"

namespace deepuav {

/// Where points of the world lie in a picture each of whose rows is taken at its own time.
class RowwiseProjection {
 public:
  /// `world_from_cam_at_row` is called once per row now, for rows from -height / 2 to height * 3 /
  /// 2; only for row 0 when `global`.
  RowwiseProjection(const Camera& camera, bool global,
                    const std::function<SE3(double row)>& world_from_cam_at_row);

  /// The pixel of a point whose position depends on the row's time; nothing where no row sees it.
  std::optional<Eigen::Vector2d> Project(
      const std::function<Eigen::Vector3d(double row)>& world_point_at_row, double first_row) const;

 private:
  const SE3& CamFromWorld(double row) const;

  const Camera& camera_;
  bool global_;
  int first_row_ = 0;
  std::vector<SE3> cam_from_world_;
};

}  // namespace deepuav
