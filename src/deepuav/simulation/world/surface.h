#pragma once

#include <Eigen/Core>

#include "deepuav/simulation/world/face_mesh.h"
#include "deepuav/simulation/world/material_textures.h"

namespace deepuav {

/// How a point of a surface looks.
struct Appearance {
  float albedo = 0.5f;
  float reflectivity = 0;  ///< Of the sky in it, seen straight on; grows at grazing angles.
  float translucency = 0;  ///< Share of the sun's light that comes through from behind.
  float glow = 0;          ///< Own radiance.
};

/// The look of a point on a face: `point` in the mesh's own frame, `normal` (unit) in it too.
/// `variant` differs between things of one mesh. Details finer than `footprint_m` are left out.
Appearance FaceAppearance(const MaterialTextures& textures, const Face& face,
                          const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
                          uint32_t variant, float footprint_m);

}  // namespace deepuav
