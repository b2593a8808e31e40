#pragma once

#include <Eigen/Core>

#include "deepuav/simulation/rendering/render_options.h"
#include "deepuav/simulation/world/material_textures.h"

namespace deepuav {

/// The light of sun and sky, and the haze between. Radiance 1 is white paper under a high sun.
class Sky {
 public:
  /// `textures` must outlive it.
  Sky(const WeatherOptions& weather, const MaterialTextures& textures);

  /// Towards the sun, unit.
  const Eigen::Vector3f& sun_direction() const { return sun_direction_; }
  float sun() const { return sun_; }

  /// Light from the sky and from the lit ground on a surface with a unit normal.
  float Ambient(const Eigen::Vector3f& normal) const {
    return sky_ * (0.62f + 0.38f * normal.z()) + bounce_ * (0.5f - 0.5f * normal.z());
  }

  /// Radiance of the sky in a direction (unit).
  float Radiance(const Eigen::Vector3f& direction) const;

  /// The radiance seen from afar, of something of `radiance` that is so far away in this direction.
  float Hazed(float radiance, float distance_m, const Eigen::Vector3f& direction) const;

 private:
  float Clear(const Eigen::Vector3f& direction) const;

  const MaterialTextures& textures_;
  Eigen::Vector3f sun_direction_;
  float sun_, sky_, bounce_, clouds_, extinction_per_m_;
};

}  // namespace deepuav
