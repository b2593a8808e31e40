#pragma once

#include <optional>
#include <vector>

#include "deepuav/estimation/poses/motion_only.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/localisation/frame_locator.h"
#include "deepuav/map/local_map.h"
#include "deepuav/patches/patch_alignment.h"

namespace deepuav {

/// Where the frame's middle row would see what the key point shows. `cam_from_world`, where it is
/// known, tells how deep that lies.
PixelMeasurement SeenAtKeypoint(const Frame& frame, const LocalMap& local_map,
                                const LocatedFrame::Seen& seen,
                                const std::optional<SE3>& cam_from_world, const Camera& camera);

/// The same by the landmark's patch in its reference keyframe; nothing where it has none, or is not
/// found. The frame must have its image.
std::optional<PixelMeasurement> SeenByPatch(const Frame& frame, const LocalMap& local_map,
                                            const LocatedFrame::Seen& seen,
                                            const SE3& cam_from_world, const Camera& camera,
                                            const PatchOptions& options);

/// What the seen landmarks say of the frame's pose: each where it was measured, else at its key
/// point. Their own noise counts where `cam_from_world` tells from where they are seen.
std::vector<PoseObservation> PoseObservations(const Frame& frame, const LocalMap& local_map,
                                              const std::vector<LocatedFrame::Seen>& seen,
                                              const std::optional<SE3>& cam_from_world,
                                              const Camera& camera);

}  // namespace deepuav
