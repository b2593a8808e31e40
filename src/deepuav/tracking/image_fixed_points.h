#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "deepuav/features/image_fixed_votes.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/tracking/tracked_pose.h"

namespace deepuav {

/// Finds where an image shows what moves along with the camera: a display's writing, the vehicle's
/// own legs, a logo, dirt on the lens. A key point there stays where it is although, as the camera
/// turned and went, nothing that stands could be seen there in both views. Thread-compatible.
class ImageFixedPoints {
 public:
  ImageFixedPoints(const Camera& camera, const ImageFixedOptions& options);

  /// Has this part of the image left out from now on, whatever is learnt.
  void Know(const ImageRegion& region);

  /// The frame without key points in the region.
  Frame Without(const Frame& frame) const;

  /// Compares a frame, with all its key points, with earlier ones. True: the region has grown.
  bool Learn(const Frame& frame, const TrackedPose& pose);

  const ImageRegion& region() const { return region_; }

 private:
  struct View {
    View(const Frame& frame, const TrackedPose& pose);

    SE3 cam_from_world;
    KeypointPlaces places;
  };
  /// Whether the key point stays in place where nothing that stands could; nothing where no view
  /// tells.
  std::optional<bool> IsFixed(const Features& features, int keypoint,
                              const SE3& cam_from_world) const;
  void Vote(const Features& features, const SE3& cam_from_world);

  const Camera camera_;
  const ImageFixedOptions options_;
  std::deque<std::unique_ptr<const View>> views_;
  ImageFixedVotes votes_;
  ImageRegion known_, region_;
  FrameId last_;
  MapId map_;
  int64_t map_revision_ = 0;
};

}  // namespace deepuav
