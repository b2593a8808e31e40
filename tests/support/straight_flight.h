#pragma once

#include <algorithm>
#include <vector>

#include "support/synthetic_map.h"

namespace deepuav {

/// A flight over rough ground, straight ahead and turning a little: 26 frames, of which every fifth
/// is a keyframe.
struct StraightFlight {
  static constexpr double kHeight = 12, kStep = 0.5;
  static constexpr int kFrames = 26, kKeyframes = 6, kFramesAKeyframe = 5;

  static SE3 PoseAt(double frame) { return LookDown({kStep * frame, 0, kHeight}, 0.01 * frame); }
  static std::vector<SE3> KeyframePoses() {
    std::vector<SE3> poses;
    for (int k = 0; k < kKeyframes; ++k) poses.push_back(PoseAt(kFramesAKeyframe * k));
    return poses;
  }
  /// The number of the last keyframe until then.
  static size_t KeyframeOf(int frame) {
    return static_cast<size_t>(std::min(frame / kFramesAKeyframe, kKeyframes - 1));
  }
  static SyntheticWorld Ground() {
    Random random(1);
    SyntheticWorld world;
    world.landmarks_world = LandmarksOnGround(2500, {-10, -10}, {30, 10}, 1, &random);
    return world;
  }
  /// From where the camera was.
  static double PositionError(const SE3& cam_from_world, int frame) {
    return (cam_from_world.InverseTranslation() - PoseAt(frame).InverseTranslation()).norm();
  }
};

}  // namespace deepuav
