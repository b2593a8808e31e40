#include "deepuav/simulation/rendering/flow.h"

#include <algorithm>
#include <cmath>

namespace deepuav {

RowwiseProjection::RowwiseProjection(const Camera& camera, bool global,
                                     const std::function<SE3(double row)>& world_from_cam_at_row)
    : camera_(camera), global_(global) {
  if (global) {
    cam_from_world_.push_back(world_from_cam_at_row(0).Inverse());
    return;
  }
  first_row_ = -camera.height / 2;
  for (int row = first_row_; row <= camera.height * 3 / 2; ++row) {
    cam_from_world_.push_back(world_from_cam_at_row(row).Inverse());
  }
}

const SE3& RowwiseProjection::CamFromWorld(double row) const {
  if (global_) return cam_from_world_.front();
  const long index = std::lround(row) - first_row_;
  return cam_from_world_[static_cast<size_t>(
      std::clamp<long>(index, 0, std::ssize(cam_from_world_) - 1))];
}

std::optional<Eigen::Vector2d> RowwiseProjection::Project(
    const std::function<Eigen::Vector3d(double row)>& world_point_at_row, double first_row) const {
  // The row decides the time and the time the row; each round shortens the error by the ratio of
  // the picture's motion to the readout's.
  constexpr int kRounds = 4;
  double row = first_row;
  std::optional<Eigen::Vector2d> pixel;
  for (int round = 0; round < (global_ ? 1 : kRounds); ++round) {
    pixel = camera_.Distort(CamFromWorld(row) * world_point_at_row(row));
    if (!pixel) return std::nullopt;
    row = pixel->y();
  }
  return pixel;
}

}  // namespace deepuav
