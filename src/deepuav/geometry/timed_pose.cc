#include "deepuav/geometry/timed_pose.h"

namespace deepuav {

Trajectory MoveTrajectory(const Sim3& new_from_old, const Trajectory& trajectory) {
  Trajectory moved;
  moved.reserve(trajectory.size());
  for (const TimedPose& pose : trajectory) {
    moved.push_back({pose.time, SE3(new_from_old.rotation() * pose.world_from_cam.rotation(),
                                    new_from_old * pose.world_from_cam.translation())});
  }
  return moved;
}

std::vector<Eigen::Vector3d> Positions(const Trajectory& trajectory) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(trajectory.size());
  for (const TimedPose& pose : trajectory) positions.push_back(pose.world_from_cam.translation());
  return positions;
}

TimedPose InterpolatePose(const TimedPose& before, const TimedPose& after, Timestamp time) {
  const double ratio = SecondsBetween(before.time, time) / SecondsBetween(before.time, after.time);
  const SE3 &first = before.world_from_cam, &second = after.world_from_cam;
  return {time, SE3(first.rotation().slerp(ratio, second.rotation()),
                    (1 - ratio) * first.translation() + ratio * second.translation())};
}

}  // namespace deepuav
