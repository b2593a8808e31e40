#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace deepuav {

/// The undistorted camera that all geometry behind the features uses: u = fx x / z + cx.
/// Pixel (0, 0) is the centre of the top-left pixel.
struct Pinhole {
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px

  Eigen::Vector2d Project(const Eigen::Vector3d& point_cam) const {
    return {fx * point_cam.x() / point_cam.z() + cx, fy * point_cam.y() / point_cam.z() + cy};
  }
  /// The point at depth 1 behind the pixel.
  Eigen::Vector3d Unproject(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1};
  }
  /// d Project / d point_cam.
  Eigen::Matrix<double, 2, 3> ProjectJacobian(const Eigen::Vector3d& point_cam) const;
  Eigen::Matrix3d Matrix() const;
};

enum class LensModel {
  kPinhole,           ///< no distortion
  kRadialTangential,  ///< k1 k2 p1 p2 [k3] (Brown, Conrady)
  kEquidistant,       ///< k1..k4 (Kannala and Brandt 2006, as in OpenCV's fisheye)
};

/// A calibrated camera: image size, pinhole parameters and lens distortion.
struct Camera {
  int width = 0, height = 0;  ///< px
  Pinhole pinhole;
  LensModel lens = LensModel::kPinhole;
  std::vector<double> distortion;
  double rate_hz = 0;  ///< Nominal frame rate; 0 where unknown.
  /// Of a rolling shutter, from the first row to the last; an image's time is its middle row's. 0:
  /// all rows at once, or unknown.
  double readout_s = 0;

  /// Throws Error that names the field when a value cannot be (sizes, focal lengths, centre outside
  /// the image, number of distortion coefficients, values that are not finite, a lens that folds
  /// over inside the image). `source` is the file named in the message.
  void Check(const std::string& source) const;

  /// The pixel in the image as taken of a point in the camera frame; nothing for a point that is
  /// not in front, or outside the range in which the lens model is one-to-one.
  std::optional<Eigen::Vector2d> Distort(const Eigen::Vector3d& point_cam) const;

  /// The pixel of the undistorted camera `pinhole` that sees what `image_px` shows; nothing where
  /// the model has no inverse or the ray is more than `max_angle` from the axis.
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& image_px) const;

  /// Rays further than this from the optical axis are not used: their pinhole pixels run away.
  static constexpr double kMaxAngleRad = 1.31;  // 75 degrees
};

/// How far apart two cameras of one image size see the same rays, at most: pixels, over a grid of
/// the image. Infinite where no ray is seen by both.
double LargestDifferencePx(const Camera& a, const Camera& b);

}  // namespace deepuav
