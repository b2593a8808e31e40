#include "deepuav/geometry/camera.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/geometry/radial_polynomial.h"

namespace deepuav {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Brown's model, as a map between points on the plane at depth 1.
class RadialTangentialLens {
 public:
  explicit RadialTangentialLens(const std::vector<double>& k)
      : radial_({k[0], k[1], k.size() > 4 ? k[4] : 0, 0}), p1_(k[2]), p2_(k[3]) {}

  const RadialPolynomial& radial() const { return radial_; }

  Eigen::Vector2d Distort(const Eigen::Vector2d& point) const {
    const double x = point.x(), y = point.y(), r2 = point.squaredNorm();
    const double factor = radial_.Factor(r2);
    return {x * factor + 2 * p1_ * x * y + p2_ * (r2 + 2 * x * x),
            y * factor + p1_ * (r2 + 2 * y * y) + 2 * p2_ * x * y};
  }

  // d Distort / d point.
  Eigen::Matrix2d Jacobian(const Eigen::Vector2d& point) const {
    const double x = point.x(), y = point.y(), r2 = point.squaredNorm();
    const double factor = radial_.Factor(r2), slope = 2 * radial_.FactorSlope(r2);
    const double mixed = slope * x * y + 2 * p1_ * x + 2 * p2_ * y;
    Eigen::Matrix2d jacobian;
    jacobian << factor + slope * x * x + 2 * p1_ * y + 6 * p2_ * x, mixed,  //
        mixed, factor + slope * y * y + 6 * p1_ * y + 2 * p2_ * x;
    return jacobian;
  }

  bool IsOneToOneAt(const Eigen::Vector2d& point) const {
    return radial_.IsOneToOneAt(point.norm(), kFoldSearchRadius) &&
           Jacobian(point).determinant() > 0;
  }

  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& distorted) const {
    const double fold_radius = radial_.OneToOneRadius(kFoldSearchRadius);
    const double end = std::min(fold_radius, std::tan(Camera::kMaxAngleRad));
    const double distorted_radius = distorted.norm();

    // The radial part alone gives the start; beyond its end the tangential part may still reach.
    const double start_radius =
        radial_.Invert(std::min(distorted_radius, kStartWithin * radial_.Distort(end)), end);
    Eigen::Vector2d point = distorted_radius > 0
                                ? Eigen::Vector2d(start_radius / distorted_radius * distorted)
                                : distorted;
    for (int i = 0; i < kMaxIterations; ++i) {
      const Eigen::Vector2d step = Jacobian(point).inverse() * (distorted - Distort(point));
      point += step;
      if (step.squaredNorm() < kStepTolerance * kStepTolerance * (1 + point.squaredNorm())) {
        if (!IsOneToOneAt(point)) return std::nullopt;
        return point;
      }
    }
    return std::nullopt;
  }

 private:
  // Folds further out than this (89.4 degrees) are as good as none.
  static constexpr double kFoldSearchRadius = 100;
  static constexpr int kMaxIterations = 30;
  static constexpr double kStepTolerance = 1e-13;
  static constexpr double kStartWithin = 1 - 1e-6;  // at the fold itself the Jacobian is singular

  RadialPolynomial radial_;
  double p1_, p2_;
};

RadialPolynomial EquidistantLens(const std::vector<double>& k) {
  return RadialPolynomial({k[0], k[1], k[2], k[3]});
}

void CheckField(bool holds, const std::string& source, const char* field, double found,
                const std::string& expected) {
  if (!holds) throw Error("{}: {} is {}: expected {}", source, field, found, expected);
}

void CheckDistortionCount(const Camera& camera, const std::string& source) {
  const size_t count = camera.distortion.size();
  const auto check = [&](bool holds, const char* expected) {
    if (!holds)
      throw Error("{}: distortion has {} coefficients: expected {}", source, count, expected);
  };
  switch (camera.lens) {
    case LensModel::kPinhole:
      return check(count == 0, "none for the pinhole model");
    case LensModel::kRadialTangential:
      return check(count == 4 || count == 5, "k1 k2 p1 p2 [k3] for the radial-tangential model");
    case LensModel::kEquidistant:
      return check(count == 4, "k1 k2 k3 k4 for the equidistant model");
  }
}

// The distorted radius, on the plane at depth 1, at which the lens folds over within the angles
// that are used; infinite where it does not.
double DistortedFoldRadius(const Camera& camera) {
  if (camera.lens == LensModel::kPinhole) return kInfinity;
  const bool equidistant = camera.lens == LensModel::kEquidistant;
  const RadialPolynomial radial = equidistant ? EquidistantLens(camera.distortion)
                                              : RadialTangentialLens(camera.distortion).radial();
  const double limit = equidistant ? Camera::kMaxAngleRad : std::tan(Camera::kMaxAngleRad);
  const double fold = radial.OneToOneRadius(limit);
  return fold < limit ? radial.Distort(fold) : kInfinity;
}

void CheckNoFoldInImage(const Camera& camera, const std::string& source) {
  const Pinhole& pinhole = camera.pinhole;
  const double x = std::max(pinhole.cx, camera.width - 1 - pinhole.cx) / pinhole.fx;
  const double y = std::max(pinhole.cy, camera.height - 1 - pinhole.cy) / pinhole.fy;
  const double fold = DistortedFoldRadius(camera);
  if (fold < std::hypot(x, y)) {
    throw Error(
        "{}: distortion folds the lens over {:.1f} px from the image's centre: expected "
        "coefficients that are "
        "one-to-one up to its corners, {:.1f} px away",
        source, fold * pinhole.fx, std::hypot(x, y) * pinhole.fx);
  }
}

// Of coefficients that are typed wrongly, most move what lies at the edge of the image by orders of
// magnitude; the strongest lenses by less than this factor.
constexpr double kStrongestLens = 10;
// Of its width over its height: images of every second line, and of wide films, have 2 at most.
constexpr double kLongestPixel = 3;

void CheckLensIsPlausible(const Camera& camera, const std::string& source) {
  if (camera.lens == LensModel::kPinhole) return;
  const Pinhole& pinhole = camera.pinhole;
  const Eigen::Vector2d last(camera.width - 1, camera.height - 1);
  int unseen = 0;
  for (const Eigen::Vector2d& side : {Eigen::Vector2d(0, pinhole.cy),
                                      {last.x(), pinhole.cy},
                                      {pinhole.cx, 0},
                                      {pinhole.cx, last.y()}}) {
    const std::optional<Eigen::Vector2d> seen = camera.Undistort(side);
    const double taken = pinhole.Unproject(side).head<2>().norm();
    if (!seen) ++unseen;
    if (!seen || taken == 0) continue;
    double undistorted = pinhole.Unproject(*seen).head<2>().norm();
    if (camera.lens == LensModel::kEquidistant) undistorted = std::atan(undistorted);
    if (taken < kStrongestLens * undistorted && undistorted < kStrongestLens * taken) continue;
    throw Error(
        "{}: distortion moves the edge of the image by a factor of {:.3g}: expected less than {}",
        source, std::max(taken / undistorted, undistorted / taken), kStrongestLens);
  }
  // A fisheye's edges may lie beyond what a pinhole camera can see.
  constexpr int kSides = 4;
  if (unseen == kSides && camera.lens == LensModel::kRadialTangential)
    throw Error("{}: distortion leaves no ray to any edge of the image", source);
}

}  // namespace

Eigen::Matrix<double, 2, 3> Pinhole::ProjectJacobian(const Eigen::Vector3d& point_cam) const {
  const double inverse_depth = 1 / point_cam.z();
  const double x = point_cam.x() * inverse_depth, y = point_cam.y() * inverse_depth;
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << fx, 0, -fx * x, 0, fy, -fy * y;
  return inverse_depth * jacobian;
}

Eigen::Matrix3d Pinhole::Matrix() const {
  Eigen::Matrix3d matrix;
  matrix << fx, 0, cx, 0, fy, cy, 0, 0, 1;
  return matrix;
}

void Camera::Check(const std::string& source) const {
  CheckField(width > 0, source, "width", width, "a positive number of pixels");
  CheckField(height > 0, source, "height", height, "a positive number of pixels");
  CheckField(std::isfinite(pinhole.fx) && pinhole.fx > 0, source, "fx", pinhole.fx,
             "a positive number of pixels");
  CheckField(std::isfinite(pinhole.fy) && pinhole.fy > 0, source, "fy", pinhole.fy,
             "a positive number of pixels");
  CheckField(
      pinhole.fy < kLongestPixel * pinhole.fx && pinhole.fx < kLongestPixel * pinhole.fy, source,
      "fy", pinhole.fy,
      fmt::format("a focal length less than {} times from fx, {}", kLongestPixel, pinhole.fx));
  CheckField(pinhole.cx > 0 && pinhole.cx < width, source, "cx", pinhole.cx,
             "a pixel inside the image");
  CheckField(pinhole.cy > 0 && pinhole.cy < height, source, "cy", pinhole.cy,
             "a pixel inside the image");
  CheckField(std::isfinite(rate_hz) && rate_hz >= 0, source, "rate_hz", rate_hz,
             "a positive rate, or 0 for unknown");
  CheckDistortionCount(*this, source);
  for (const double k : distortion)
    CheckField(std::isfinite(k), source, "distortion", k, "finite coefficients");
  CheckNoFoldInImage(*this, source);
  CheckLensIsPlausible(*this, source);
}

std::optional<Eigen::Vector2d> Camera::Distort(const Eigen::Vector3d& point_cam) const {
  if (!(point_cam.z() > 0) || !point_cam.allFinite()) return std::nullopt;
  const Eigen::Vector2d point = point_cam.head<2>() / point_cam.z();
  Eigen::Vector2d distorted = point;
  if (lens == LensModel::kRadialTangential) {
    const RadialTangentialLens model(distortion);
    if (!model.IsOneToOneAt(point)) return std::nullopt;
    distorted = model.Distort(point);
  } else if (lens == LensModel::kEquidistant) {
    const RadialPolynomial model = EquidistantLens(distortion);
    const double radius = point.norm(), angle = std::atan(radius);
    if (!model.IsOneToOneAt(angle, M_PI / 2)) return std::nullopt;
    if (radius > 0) distorted *= model.Distort(angle) / radius;
  }
  return pinhole.Project(distorted.homogeneous());
}

std::optional<Eigen::Vector2d> Camera::Undistort(const Eigen::Vector2d& image_px) const {
  if (!image_px.allFinite()) return std::nullopt;
  const Eigen::Vector2d distorted = pinhole.Unproject(image_px).head<2>();
  std::optional<Eigen::Vector2d> point = distorted;
  if (lens == LensModel::kRadialTangential) {
    point = RadialTangentialLens(distortion).Undistort(distorted);
  } else if (lens == LensModel::kEquidistant) {
    const RadialPolynomial model = EquidistantLens(distortion);
    const double radius = distorted.norm(), end = model.OneToOneRadius(kMaxAngleRad);
    if (radius >= model.Distort(end)) return std::nullopt;
    if (radius > 0) *point *= std::tan(model.Invert(radius, end)) / radius;
  }
  if (!point || point->norm() > std::tan(kMaxAngleRad)) return std::nullopt;
  return pinhole.Project(point->homogeneous());
}

double LargestDifferencePx(const Camera& a, const Camera& b) {
  constexpr int kGridSteps = 8;
  double largest = -1;
  for (int row = 0; row <= kGridSteps; ++row) {
    for (int column = 0; column <= kGridSteps; ++column) {
      const Eigen::Vector2d pixel(column * (a.width - 1.0) / kGridSteps,
                                  row * (a.height - 1.0) / kGridSteps);
      const auto undistorted = a.Undistort(pixel);
      if (!undistorted) continue;
      const auto seen = b.Distort(a.pinhole.Unproject(*undistorted));
      if (seen) largest = std::max(largest, (*seen - pixel).norm());
    }
  }
  return largest < 0 ? std::numeric_limits<double>::infinity() : largest;
}

}  // namespace deepuav
