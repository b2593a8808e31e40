#include "view_overlap.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace deepuav {

OverlapJudge::OverlapJudge(const Camera& camera, bool has_orientation, const OverlapBounds& bounds)
    : camera_(camera),
      has_orientation_(has_orientation),
      least_overlap_(bounds.same_place),
      least_noticeable_(bounds.noticeable),
      depth_m_(bounds.depth_m) {
  constexpr double kDepthFactors[] = {0.5, 1, 2};
  constexpr int kColumns = 12, kRows = 9;
  for (const double factor : kDepthFactors) {
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Eigen::Vector2d px((i % kColumns + 0.5) * camera.width / kColumns,
                               (i / kColumns + 0.5) * camera.height / kRows);
      points_cam_.push_back(factor * depth_m_ * camera.pinhole.Unproject(px));
    }
  }
}

Relation OverlapJudge::Judge(const SE3& world_from_a, const SE3& world_from_b) const {
  const double overlap =
      has_orientation_
          ? std::min(SeenBy(world_from_a, world_from_b), SeenBy(world_from_b, world_from_a))
          : DiscOverlap((world_from_a.translation() - world_from_b.translation()).norm());
  if (overlap >= least_overlap_) return Relation::kSamePlace;
  return overlap >= least_noticeable_ ? Relation::kBetween : Relation::kOtherPlace;
}

double OverlapJudge::SeenBy(const SE3& world_from_a, const SE3& world_from_b) const {
  const SE3 b_from_a = world_from_b.Inverse() * world_from_a;
  int seen = 0;
  for (const Eigen::Vector3d& point : points_cam_) {
    const Eigen::Vector3d in_b = b_from_a * point;
    if (in_b.z() <= 0) continue;
    const Eigen::Vector2d px = camera_.pinhole.Project(in_b);
    seen += px.x() >= 0 && px.y() >= 0 && px.x() < camera_.width && px.y() < camera_.height;
  }
  return seen / static_cast<double>(points_cam_.size());
}

double OverlapJudge::DiscOverlap(double distance_m) const {
  const double radius_m =
      0.5 * depth_m_ * std::min(camera_.width, camera_.height) / camera_.pinhole.fx;
  const double half = distance_m / (2 * radius_m);
  if (half >= 1) return 0;
  return 2 / std::numbers::pi * (std::acos(half) - half * std::sqrt(1 - half * half));
}

}  // namespace deepuav
