#pragma once

#include "deepuav/geometry/camera.h"
#include "deepuav/simulation/rendering/camera_rays.h"
#include "deepuav/simulation/rendering/render_options.h"
#include "deepuav/simulation/rendering/renderer.h"
#include "deepuav/simulation/rendering/sensor.h"
#include "deepuav/simulation/rendering/sky.h"
#include "deepuav/simulation/world/world_geometry.h"

namespace deepuav {

/// The camera's automatic exposure: by the lagging mean, over the last while, of what a few rays
/// see. So a picture follows from its time alone, not from pictures rendered before.
class ExposureMeter {
 public:
  /// All but the options must outlive it.
  ExposureMeter(const WorldGeometry& world, const Sky& sky, const Camera& camera,
                const CameraRays& rays, const SensorOptions& sensor)
      : world_(world), sky_(sky), camera_(camera), rays_(rays), sensor_(sensor) {}

  /// The setting of a picture whose middle row is exposed at `time_s`.
  ExposureSetting Meter(const PathOfCamera& path, double time_s) const;

 private:
  const WorldGeometry& world_;
  const Sky& sky_;
  const Camera& camera_;
  const CameraRays& rays_;
  const SensorOptions sensor_;
};

}  // namespace deepuav
