#include "deepuav/tracking/image_fixed_points.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace deepuav {
namespace {

/// How far from `px` the nearest place is where the second view could show a point that stands and
/// that the first shows at `px`: any at a positive depth, up to the camera itself. Infinite where
/// it would lie behind the second camera.
double Contradiction_px(const Pinhole& pinhole, const SE3& second_from_first,
                        const Eigen::Vector2d& px) {
  const Eigen::Vector3d far = second_from_first.rotation() * pinhole.Unproject(px);
  const Eigen::Vector3d& travel = second_from_first.translation();
  if (far.z() <= 0) return std::numeric_limits<double>::infinity();
  const Eigen::Vector2d farthest = pinhole.Project(far);
  // Of Project(far + travel / depth), seen from its place at infinity.
  const Eigen::Vector2d nearer(pinhole.fx * (travel.x() * far.z() - travel.z() * far.x()),
                               pinhole.fy * (travel.y() * far.z() - travel.z() * far.y()));
  const double length = nearer.norm();
  if (!(length > 0)) return (px - farthest).norm();
  const Eigen::Vector2d along = nearer / length;
  const double end = travel.z() > 0 ? along.dot(pinhole.Project(travel) - farthest)
                                    : std::numeric_limits<double>::infinity();
  const double there = std::clamp(along.dot(px - farthest), 0., std::max(0., end));
  return (px - farthest - there * along).norm();
}

}  // namespace

ImageFixedPoints::View::View(const Frame& frame, const TrackedPose& pose)
    : cam_from_world(pose.cam_from_world), places(frame.features) {}

ImageFixedPoints::ImageFixedPoints(const Camera& camera, const ImageFixedOptions& options)
    : camera_(camera),
      options_(options),
      votes_(camera.width, camera.height, options),
      known_(votes_.blank()),
      region_(known_) {}

void ImageFixedPoints::Know(const ImageRegion& region) {
  known_.Add(region);
  region_.Add(region);
}

Frame ImageFixedPoints::Without(const Frame& frame) const {
  Frame without = frame;
  without.features = Outside(region_, frame.features);
  return without;
}

bool ImageFixedPoints::Learn(const Frame& frame, const TrackedPose& pose) {
  if (!options_.set_aside) return false;
  if (pose.map != map_ || pose.map_revision != map_revision_) views_.clear();
  map_ = pose.map;
  map_revision_ = pose.map_revision;
  if (!views_.empty() && frame.id.value - last_.value < options_.interval_frames) return false;
  last_ = frame.id;
  Vote(*frame.features, pose.cam_from_world);
  views_.push_back(std::make_unique<const View>(frame, pose));
  if (views_.size() > static_cast<size_t>(options_.kept_views)) views_.pop_front();
  const ImageRegion before = std::exchange(region_, votes_.Region());
  region_.Add(known_);
  return region_.HasMoreThan(before);
}

std::optional<bool> ImageFixedPoints::IsFixed(const Features& features, int keypoint,
                                              const SE3& cam_from_world) const {
  const Eigen::Vector2d px = features.keypoints[static_cast<size_t>(keypoint)].px.cast<double>();
  int telling = 0, fixed = 0;
  for (const auto& view : views_) {
    const SE3 now_from_then = cam_from_world * view->cam_from_world.Inverse();
    if (Contradiction_px(camera_.pinhole, now_from_then, px) < options_.min_contradiction_px)
      continue;
    ++telling;
    if (view->places.HasThere(features, keypoint, options_)) ++fixed;
  }
  if (telling == 0) return std::nullopt;
  return 2 * fixed > telling;
}

void ImageFixedPoints::Vote(const Features& features, const SE3& cam_from_world) {
  std::vector<int> telling, fixed;
  for (int i = 0; i < features.size(); ++i) {
    const std::optional<bool> is_fixed = IsFixed(features, i, cam_from_world);
    if (!is_fixed) continue;
    const int cell = region_.CellOf(features.keypoints[static_cast<size_t>(i)].image_px);
    telling.push_back(cell);
    if (*is_fixed) fixed.push_back(cell);
  }
  votes_.Count(telling, fixed);
}

}  // namespace deepuav
