#pragma once

#include <vector>

#include "deepuav/api/types.h"
#include "deepuav/geometry/camera.h"
#include "deepuav/image/image.h"
#include "deepuav/io/geodata/map_origin.h"
#include "deepuav/io/geodata/trajectory.h"
#include "deepuav/map/atlas.h"
#include "deepuav/system/frames/frame_record.h"

namespace deepuav::api {

namespace core = ::deepuav;

Vector3 ToApi(const Eigen::Vector3d& vector);
Pose ToApi(const SE3& pose);
Camera ToApi(const core::Camera& camera);

Eigen::Vector3d ToCore(const Vector3& vector);
/// Throws core's Error for a rotation that is none.
SE3 ToCore(const Pose& pose);
core::Camera ToCore(const Camera& camera);
Trajectory ToCore(const std::vector<TimedPose>& poses);

/// A copy as grey. Throws core's Error for a view without pixels.
GreyImage GreyOf(const ImageView& view);

/// As it was when its turn came; `map` is the map's id in the run.
Frame FrameOf(const FrameRecord& record);

/// Of all maps, numbered as in their file, by map and id.
std::vector<Keyframe> KeyframesOf(const Atlas& atlas, const ImageNames& names);
std::vector<Landmark> LandmarksOf(const Atlas& atlas);
std::vector<MapInfo> MapsOf(const Atlas& atlas);

}  // namespace deepuav::api
