#include "deepuav/map/frame_motion.h"

#include <memory>
#include <utility>

#include "deepuav/features/readout_correction.h"

namespace deepuav {

Frame WithMotion(Frame frame, const ReadoutMotion& motion, const Camera& camera) {
  if (!motion.TurnsAs(frame.motion)) {
    frame.features = std::make_shared<const Features>(
        CorrectedForTurn(*frame.features, frame.motion, motion, camera));
  }
  frame.motion = motion;
  return frame;
}

ReadoutMotion WithTurnOf(const ReadoutMotion& turning, ReadoutMotion motion) {
  motion.turn_rad = turning.turn_rad;
  motion.bend_rad = turning.bend_rad;
  return motion;
}

Frame MovingOn(const Frame& frame, const SE3& cam_from_world, const SE3& other_from_world,
               double between_s, const Camera& camera) {
  if (camera.readout_s == 0) return frame;
  const ReadoutMotion motion =
      MotionInReadout(other_from_world, cam_from_world, between_s, camera.readout_s);
  return WithMotion(frame, frame.turn_is_measured ? WithTurnOf(frame.motion, motion) : motion,
                    camera);
}

}  // namespace deepuav
