#pragma once

#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/estimation/paths/smooth_path.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav {

struct PathSmoothingOptions {
  SmoothPathOptions path;
  double motion_window_s = 3;  ///< Before and after, from which follows how the camera moves...
  int firm_landmarks = 100;    ///< ...by poses that rest on so many landmarks.
  double max_step = 3;         ///< Over the median time between frames: a longer one divides.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    path.Visit(visit);
    visit("motion_window_s", motion_window_s, "s",
          "before and after a frame, from which follows how unsteadily the camera moves",
          Above(0, 1e6));
    visit("firm_landmarks", firm_landmarks, "",
          "landmarks of a pose that tells how the camera moves", Between(0, 100'000));
    visit("max_step", max_step, "",
          "time between two located frames over the median, beyond which they do not hold each "
          "other",
          Between(1, 1000));
  }
};

/// Gives the frames between keyframes the poses that their own landmarks and the motion of the
/// camera together make most probable. A frame that sees little, as in a quick turn, is else off by
/// what its few pixels leave open, many times the error of those around.
class PathSmoothing {
 public:
  /// The atlas must outlive it.
  PathSmoothing(const PathSmoothingOptions& options, const Atlas& atlas);

  /// The records' poses are those of the final maps: keyframes stay.
  void Smooth(std::vector<FrameRecord>* records) const;

 private:
  using Stretch = std::vector<FrameRecord*>;
  /// Frames one after another in one map.
  std::vector<Stretch> Stretches(std::vector<FrameRecord>* records) const;
  void SmoothStretch(const Stretch& stretch) const;
  PathPose PoseOf(const FrameRecord& record, Timestamp start) const;
  bool IsKeyframe(const FrameRecord& record) const;

  const PathSmoothingOptions options_;
  const Atlas& atlas_;
};

}  // namespace deepuav
