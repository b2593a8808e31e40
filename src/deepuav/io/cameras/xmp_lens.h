#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace deepuav {

/// A lens as its maker measured it, in Brown's model of radial (k1, k2, k3 over 1 + k4
/// r^2 + ...) and tangential distortion, as OpenCV has it.
struct MeasuredLens {
  bool in_mm = false;  ///< Focal lengths and centre; else px of the image as the camera wrote it.
  double fx = 0, fy = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  bool is_centre_from_corner = false;  ///< The image's upper left one; else from its middle.
  std::array<double, 6> radial{};
  double p1 = 0, p2 = 0;
  bool is_undone = false;  ///< The picture shows what a lens without distortion would.
};

/// What a maker's XMP says of the lens.
struct XmpLens {
  /// As designed, in pixels of the image as the camera wrote it: DJI's
  /// drone-dji:CalibratedFocalLength, with CalibratedOpticalCenterX, Y. 0: not said.
  double focal_px = 0;
  std::optional<double> cx_px, cy_px;
  /// DJI's drone-dji:DewarpData (or DewarpDataK6): the date; fx, fy, the centre from the image's
  /// middle, k1, k2, p1, p2, k3 (, k4, k5, k6). Pix4D's Camera:PerspectiveFocalLength,
  /// PrincipalPoint, PerspectiveDistortion: k1, k2, k3, p1, p2.
  std::optional<MeasuredLens> measured = {};
};

/// From the first bytes of a photograph; nothing where they say nothing that can be.
std::optional<XmpLens> ParseXmpLens(std::string_view head);

/// Of a camera that takes one of several bands at once, that band's name: Camera:BandName or
/// drone-dji:BandName. Empty where it is not said, and of a camera in colour, which names three.
std::string ParseXmpBand(std::string_view head);

}  // namespace deepuav
