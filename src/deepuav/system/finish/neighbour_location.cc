#include "deepuav/system/finish/neighbour_location.h"

#include <algorithm>

namespace deepuav {

LocationPrior PriorBeside(const Map& map, const FrameRecord& neighbour, const FrameRecord* before,
                          Timestamp time) {
  LocationPrior prior;
  prior.reference = map.Remaining(neighbour.pose.keyframe);
  prior.cam_from_world = neighbour.cam_from_world;
  prior.neighbour = TimedPose{neighbour.time, neighbour.cam_from_world.Inverse()};
  if (before && before->time != neighbour.time) {
    const SE3 step = neighbour.cam_from_world * before->cam_from_world.Inverse();
    const double ratio =
        SecondsBetween(neighbour.time, time) / SecondsBetween(before->time, neighbour.time);
    prior.cam_from_world = SE3::Exp(step.Log() * ratio) * neighbour.cam_from_world;
  }
  for (const FrameRecord::Seen& seen : neighbour.seen) {
    if (const auto landmark = map.Current(seen.landmark)) prior.landmarks.push_back(*landmark);
  }
  std::sort(prior.landmarks.begin(), prior.landmarks.end());
  prior.landmarks.erase(std::unique(prior.landmarks.begin(), prior.landmarks.end()),
                        prior.landmarks.end());
  return prior;
}

FrameRecord LocatedRecord(const Frame& frame, const TrackedPose& pose) {
  TrackingResult result;
  result.state = TrackingState::kTracking;
  result.pose = pose;
  return MakeRecord(frame, result);
}

Frame FrameToLocate(const FrameRecord& record) {
  return {record.id, record.time, record.features, nullptr, record.motion, record.turn_is_measured};
}

}  // namespace deepuav
