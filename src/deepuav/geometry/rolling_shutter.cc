#include "deepuav/geometry/rolling_shutter.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace deepuav {
namespace {

/// Each brings the row nearer by the share of a row that the image is sheared by.
constexpr int kRowIterations = 3;

}  // namespace

ReadoutMotion MotionInReadout(const SE3& before_from_world, const SE3& now_from_world,
                              double between_s, double readout_s) {
  if (between_s == 0 || readout_s == 0) return {};
  const SE3 before_from_now = before_from_world * now_from_world.Inverse();
  const double share = readout_s / between_s;
  return {share * before_from_now.Log().tail<3>(),
          -share * (now_from_world * before_from_world.InverseTranslation()),
          Eigen::Vector3d::Zero()};
}

ReadoutMotion InReadout(const ReadoutMotion& motion_per_s, double readout_s) {
  return {readout_s * motion_per_s.turn_rad, readout_s * motion_per_s.travel,
          readout_s * readout_s * motion_per_s.bend_rad};
}

double RowMoment(double row, int height) {
  return height > 1 ? std::clamp(row / (height - 1), 0.0, 1.0) - 0.5 : 0;
}

Eigen::Vector2d ToMiddleRow(const Pinhole& pinhole, const Eigen::Vector2d& px, double moment,
                            const ReadoutMotion& motion, double inverse_depth) {
  if (motion.IsNone()) return px;
  const Eigen::Vector3d ray = RotationExp(motion.TurnAt(moment)) * pinhole.Unproject(px);
  return pinhole.Project(ray + moment * inverse_depth * motion.travel);
}

Eigen::Vector2d FromMiddleRow(const Pinhole& pinhole, const Eigen::Vector2d& px, double moment,
                              const ReadoutMotion& motion, double inverse_depth) {
  if (motion.IsNone()) return px;
  const Eigen::Vector3d ray = pinhole.Unproject(px) - moment * inverse_depth * motion.travel;
  return pinhole.Project(RotationExp(-motion.TurnAt(moment)) * ray);
}

std::optional<Eigen::Vector2d> DistortInRow(const Camera& camera, const Eigen::Vector2d& px,
                                            const ReadoutMotion& motion, double inverse_depth) {
  std::optional<Eigen::Vector2d> image_px = camera.Distort(camera.pinhole.Unproject(px));
  if (motion.IsNone()) return image_px;
  for (int i = 0; i < kRowIterations && image_px; ++i) {
    const Eigen::Vector2d in_row = FromMiddleRow(
        camera.pinhole, px, RowMoment(image_px->y(), camera.height), motion, inverse_depth);
    image_px = camera.Distort(camera.pinhole.Unproject(in_row));
  }
  return image_px;
}

std::optional<Eigen::Vector2d> ForOtherMotion(const Camera& camera, const Eigen::Vector2d& px,
                                              const ReadoutMotion& known,
                                              const ReadoutMotion& motion, double inverse_depth) {
  const auto image_px = DistortInRow(camera, px, known, inverse_depth);
  if (!image_px) return std::nullopt;
  const double moment = RowMoment(image_px->y(), camera.height);
  const Eigen::Vector2d in_row = FromMiddleRow(camera.pinhole, px, moment, known, inverse_depth);
  const Eigen::Vector3d travel = moment * inverse_depth * motion.travel;
  const Eigen::Vector3d ray = RotationExp(motion.TurnAt(moment)) * camera.pinhole.Unproject(in_row);
  // As long as the depth that the middle row sees.
  return camera.pinhole.Project((1 - travel.z()) / ray.z() * ray + travel);
}

}  // namespace deepuav
