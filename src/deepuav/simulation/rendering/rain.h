#pragma once

#include <opencv2/core.hpp>

#include "deepuav/geometry/camera.h"
#include "deepuav/geometry/se3.h"
#include "deepuav/simulation/rendering/render_options.h"

namespace deepuav {

/// Draws falling drops into a picture of light. Drops fill space around the camera and fall by the
/// true time, so that streaks follow from their motion and the camera's during the exposure.
struct RainView {
  SE3 world_from_cam_start, world_from_cam_end;
  double start_s, end_s;
  float drop_radiance;
};
void DrawRain(const WeatherOptions& weather, const Camera& camera, const RainView& view,
              uint64_t seed, cv::Mat1f* radiance);

}  // namespace deepuav
