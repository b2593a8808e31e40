#include "deepuav/estimation/poses/p3p.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace deepuav {
namespace {

using Conic = Eigen::Matrix3d;
using Points = std::array<Eigen::Vector3d, 3>;

constexpr double kCollinear = 1e-7;  ///< Sine of a triangle's angle.
constexpr double kResidual = 1e-8;   ///< Of a squared side, over the largest one.
constexpr double kRounding = 1e-12;  ///< A discriminant so little below zero, over its terms.
constexpr int kNewtonSteps = 2;      ///< Of the cubic's root, and of the distances.
constexpr int kSides[3][2] = {{0, 1}, {0, 2}, {1, 2}};

/// The law of cosines for each side of the triangle: d^T shape d = squared length, d the distances
/// of the three points from the camera's centre.
struct Triangle {
  std::array<Conic, 3> shapes;
  Eigen::Vector3d squared;  ///< Lengths, over the largest.
  double scale = 0;         ///< The largest side, world units.
};

Triangle TriangleOf(const Points& points_world, const Points& rays_cam) {
  Triangle triangle;
  for (int side = 0; side < 3; ++side) {
    const auto [i, j] = kSides[side];
    Conic& shape = triangle.shapes[static_cast<size_t>(side)];
    shape.setZero();
    shape(i, i) = shape(j, j) = 1;
    shape(i, j) = shape(j, i) =
        -rays_cam[static_cast<size_t>(i)].dot(rays_cam[static_cast<size_t>(j)]);
    triangle.squared[side] =
        (points_world[static_cast<size_t>(i)] - points_world[static_cast<size_t>(j)]).squaredNorm();
  }
  triangle.scale = std::sqrt(triangle.squared.maxCoeff());
  triangle.squared /= triangle.squared.maxCoeff();
  return triangle;
}

/// A real root of x^3 + b x^2 + c x + d.
double RealRoot(double b, double c, double d) {
  const double p = c - b * b / 3, q = 2 * b * b * b / 27 - b * c / 3 + d;
  const double discriminant = q * q / 4 + p * p * p / 27;
  double x;
  if (discriminant >= 0) {
    const double u = std::cbrt(-q / 2 - std::copysign(std::sqrt(discriminant), q));
    x = (u == 0 ? 0 : u - p / (3 * u)) - b / 3;
  } else {
    const double m = 2 * std::sqrt(-p / 3);
    x = m * std::cos(std::acos(std::clamp(3 * q / (p * m), -1.0, 1.0)) / 3) - b / 3;
  }
  for (int step = 0; step < kNewtonSteps; ++step) {
    const double slope = (3 * x + 2 * b) * x + c;
    if (slope == 0) break;
    x -= (((x + b) * x + c) * x + d) / slope;
  }
  return x;
}

/// The determinants of `a` with each column in turn replaced by `b`'s, summed.
double MixedDeterminant(const Conic& a, const Conic& b) {
  return b.col(0).dot(a.col(1).cross(a.col(2))) + b.col(1).dot(a.col(2).cross(a.col(0))) +
         b.col(2).dot(a.col(0).cross(a.col(1)));
}

/// A conic through the common points of `a` and `b` that is a pair of lines, and the one of both
/// that is the less like it.
struct Pencil {
  Conic lines;
  Conic other;
};

Pencil DegenerateMember(const Conic& a, const Conic& b) {
  const double det_a = a.determinant(), det_b = b.determinant();
  if (std::abs(det_b) < std::abs(det_a)) return DegenerateMember(b, a);
  if (det_b == 0) return {a, b};
  const double root =
      RealRoot(MixedDeterminant(b, a) / det_b, MixedDeterminant(a, b) / det_b, det_a / det_b);
  return {a + root * b, std::abs(root) > 1 ? a : b};
}

/// l and m of the pair of lines l m^T + m l^T; none where the lines are not real (Richter-Gebert,
/// Perspectives on Projective Geometry, 11.1).
std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> SplitLines(const Conic& pair) {
  Conic cofactors;
  for (int i = 0; i < 3; ++i) cofactors.col(i) = pair.col((i + 1) % 3).cross(pair.col((i + 2) % 3));
  int largest;
  const double squared = (-cofactors.diagonal()).maxCoeff(&largest);
  if (!(squared > 0)) return std::nullopt;
  const Eigen::Vector3d common = -cofactors.col(largest) / std::sqrt(squared);
  const Conic product = pair + Skew(common);
  int row, column;
  product.cwiseAbs().maxCoeff(&row, &column);
  return std::pair<Eigen::Vector3d, Eigen::Vector3d>(product.row(row), product.col(column));
}

/// Where the line cuts the conic: two directions, or none.
std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> Cut(const Eigen::Vector3d& line,
                                                               const Conic& conic) {
  const Eigen::Vector3d u = line.unitOrthogonal();
  const Eigen::Vector3d v = line.cross(u).normalized();
  const double uu = u.dot(conic * u), uv = u.dot(conic * v), vv = v.dot(conic * v);
  double discriminant = uv * uv - uu * vv;
  if (discriminant < -kRounding * (uv * uv + std::abs(uu * vv))) return std::nullopt;
  discriminant = std::max(discriminant, 0.0);
  const double r = -(uv + std::copysign(std::sqrt(discriminant), uv));
  return std::pair<Eigen::Vector3d, Eigen::Vector3d>(vv * u + r * v, r * u + uu * v);
}

/// The distances along `direction` that fit the triangle, made exact by Newton's method.
std::optional<Eigen::Vector3d> Distances(const Eigen::Vector3d& direction,
                                         const Triangle& triangle) {
  Eigen::Vector3d d = direction.sum() < 0 ? -direction : direction;
  if (!(d.minCoeff() > 0)) return std::nullopt;
  const Conic all = triangle.shapes[0] + triangle.shapes[1] + triangle.shapes[2];
  const double squared = d.dot(all * d);
  if (!(squared > 0)) return std::nullopt;
  d *= std::sqrt(triangle.squared.sum() / squared);

  Eigen::Vector3d residual;
  for (int step = 0;; ++step) {
    Eigen::Matrix3d jacobian;
    for (int side = 0; side < 3; ++side) {
      const Eigen::Vector3d half_gradient = triangle.shapes[static_cast<size_t>(side)] * d;
      residual[side] = d.dot(half_gradient) - triangle.squared[side];
      jacobian.row(side) = 2 * half_gradient.transpose();
    }
    if (step == kNewtonSteps) break;
    d -= jacobian.inverse() * residual;
  }
  if (!(residual.cwiseAbs().maxCoeff() < kResidual) || !(d.minCoeff() > 0)) return std::nullopt;
  return d * triangle.scale;
}

/// The axes of a triangle: along its first side, in its plane, off its plane.
Eigen::Matrix3d Axes(const Points& points) {
  Eigen::Matrix3d axes;
  axes.col(0) = (points[1] - points[0]).normalized();
  axes.col(2) = axes.col(0).cross(points[2] - points[0]).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

bool IsCollinear(const Points& points) {
  const Eigen::Vector3d a = points[1] - points[0], b = points[2] - points[0];
  return !(a.cross(b).norm() > kCollinear * a.norm() * b.norm());
}

}  // namespace

P3PSolutions SolveP3P(const Points& points_world, const Points& rays_cam) {
  P3PSolutions solutions;
  if (IsCollinear(points_world)) return solutions;
  const Triangle triangle = TriangleOf(points_world, rays_cam);
  const auto& [first, second, third] = triangle.shapes;
  const Pencil pencil =
      DegenerateMember(triangle.squared[2] * first - triangle.squared[0] * third,
                       triangle.squared[2] * second - triangle.squared[1] * third);
  const auto lines = SplitLines(pencil.lines);
  if (!lines) return solutions;

  const Eigen::Matrix3d world_axes = Axes(points_world);
  for (const Eigen::Vector3d& line : {lines->first, lines->second}) {
    const auto directions = Cut(line, pencil.other);
    if (!directions) continue;
    for (const Eigen::Vector3d& direction : {directions->first, directions->second}) {
      const auto distances = Distances(direction, triangle);
      if (!distances) continue;
      Points points_cam;
      for (size_t i = 0; i < 3; ++i)
        points_cam[i] = (*distances)[static_cast<int>(i)] * rays_cam[i];
      const Eigen::Matrix3d rotation = Axes(points_cam) * world_axes.transpose();
      const SE3 pose(rotation, points_cam[0] - rotation * points_world[0]);
      solutions.cams_from_world[static_cast<size_t>(solutions.count++)] = pose;
    }
  }
  return solutions;
}

}  // namespace deepuav
