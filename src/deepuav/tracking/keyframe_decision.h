#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/localisation/frame_locator.h"

namespace deepuav {

struct KeyframeOptions {
  double min_shared_ratio =
      0.65;              ///< Landmarks shared with the reference keyframe over all of its own.
  int min_matches = 80;  ///< Landmarks seen by the frame.
  double max_parallax_deg = 4;  ///< Mean over the landmarks, between frame and reference keyframe.
  int min_gap_frames = 1;       ///< Since the last keyframe.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_shared_ratio", min_shared_ratio, "",
          "share of the reference's landmarks, below which a keyframe is made", Between(0, 1));
    visit("min_matches", min_matches, "", "landmarks seen, below which a keyframe is made",
          Between(0, 100'000));
    visit("max_parallax_deg", max_parallax_deg, "deg",
          "mean parallax to the reference that makes a keyframe", Above(0, 180));
    visit("min_gap_frames", min_gap_frames, "", "frames from one keyframe to the next, at least",
          Between(1, 1'000'000));
  }
};

/// Whether the map needs this frame.
bool NeedsKeyframe(const LocatedFrame& located, const LocalMap& local_map,
                   int frames_since_keyframe, const KeyframeOptions& options);

}  // namespace deepuav
