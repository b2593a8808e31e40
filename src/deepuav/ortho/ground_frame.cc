#include "deepuav/ortho/ground_frame.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <optional>

#include "deepuav/base/error.h"
#include "deepuav/base/median.h"
#include "deepuav/base/random.h"
#include "deepuav/sensors/geodesy.h"

namespace deepuav {
namespace {

/// normal . p = distance.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double distance = 0;

  double Off(const Eigen::Vector3d& point) const { return std::abs(normal.dot(point) - distance); }
};

std::optional<Plane> PlaneThrough(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  if (!(normal.norm() > 0)) return std::nullopt;
  return Plane{normal.normalized(), normal.normalized().dot(a)};
}

double MedianOff(const Plane& plane, const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> offs;
  offs.reserve(points.size());
  for (const Eigen::Vector3d& point : points) offs.push_back(plane.Off(point));
  return Median(std::move(offs));
}

/// Evenly thinned out.
std::vector<Eigen::Vector3d> Sample(const std::vector<Eigen::Vector3d>& points, size_t most) {
  if (points.size() <= most) return points;
  std::vector<Eigen::Vector3d> sample;
  for (size_t i = 0; i < most; ++i) sample.push_back(points[i * points.size() / most]);
  return sample;
}

/// Of least squares through the points near `plane`.
Plane Refined(const Plane& plane, const std::vector<Eigen::Vector3d>& points) {
  constexpr double kNear = 2.5;  // times the median distance
  const double limit = kNear * MedianOff(plane, points);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Eigen::Vector3d& point : points) {
    if (plane.Off(point) > limit) continue;
    mean += point;
    ++count;
  }
  mean /= count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    if (plane.Off(point) <= limit) scatter += (point - mean) * (point - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(scatter);
  const Eigen::Vector3d normal = axes.eigenvectors().col(0);
  return {normal, normal.dot(mean)};
}

/// The plane that half of the points are nearest to (least median of distances).
Plane FitPlane(const std::vector<Eigen::Vector3d>& points) {
  constexpr int kTrials = 300, kRefinements = 5;
  constexpr size_t kMostPoints = 2000;
  constexpr uint64_t kSeed = 1;
  const std::vector<Eigen::Vector3d> sample = Sample(points, kMostPoints);
  Random random(kSeed);
  std::optional<Plane> best;
  double best_off = 0;
  for (int i = 0; i < kTrials; ++i) {
    std::array<Eigen::Vector3d, 3> corners;
    for (Eigen::Vector3d& corner : corners)
      corner = sample[static_cast<size_t>(random.Index(static_cast<int>(sample.size())))];
    const auto plane = PlaneThrough(corners[0], corners[1], corners[2]);
    if (!plane) continue;
    const double off = MedianOff(*plane, sample);
    if (!best || off < best_off) best = plane, best_off = off;
  }
  if (!best) throw Error("the map's {} landmarks lie on a line: expected ground", points.size());
  for (int i = 0; i < kRefinements; ++i) best = Refined(*best, sample);
  return *best;
}

GroundFrame UtmFrame(const GeoPoint& origin) {
  const UtmZone zone = UtmZoneOf(origin);
  return {.ground_from_world =
              [origin, zone](const Eigen::Vector3d& position) {
                return UtmFromGeo(zone, GeoFromLocal(origin, position));
              },
          .world_from_ground =
              [origin, zone](const Eigen::Vector3d& position) {
                return LocalFromGeo(origin, GeoFromUtm(zone, position));
              },
          .epsg = zone.Epsg(),
          .about = fmt::format("UTM zone {}{}, heights as of the position fixes", zone.number,
                               zone.is_north ? 'N' : 'S')};
}

GroundFrame TurnedFrame(const SE3& level_from_world, std::string about) {
  return {.ground_from_world =
              [level_from_world](const Eigen::Vector3d& p) { return level_from_world * p; },
          .world_from_ground =
              [world = level_from_world.Inverse()](const Eigen::Vector3d& p) { return world * p; },
          .epsg = {},
          .about = std::move(about)};
}

}  // namespace

SE3 LevelFromWorld(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<Eigen::Vector3d>& cameras) {
  constexpr size_t kFewestPoints = 3;
  if (points.size() < kFewestPoints)
    throw Error("the map has {} landmarks: expected at least {}", points.size(), kFewestPoints);
  const Plane plane = FitPlane(points);
  std::vector<double> heights;
  for (const Eigen::Vector3d& camera : cameras)
    heights.push_back(plane.normal.dot(camera) - plane.distance);
  const Eigen::Vector3d up =
      heights.empty() || Median(heights) >= 0 ? plane.normal : Eigen::Vector3d(-plane.normal);
  // Straight up x itself would leave no direction on the plane.
  constexpr double kSteep = 0.9;
  const Eigen::Vector3d along =
      std::abs(up.x()) < kSteep ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  Eigen::Matrix3d level;
  level.row(2) = up;
  level.row(0) = (along - up * up.dot(along)).normalized();
  level.row(1) = Eigen::Vector3d(level.row(2)).cross(Eigen::Vector3d(level.row(0)));
  return {Eigen::Quaterniond(level), Eigen::Vector3d::Zero()};
}

GroundFrame MakeGroundFrame(const Gauge& gauge, const std::vector<Eigen::Vector3d>& points,
                            const std::vector<Eigen::Vector3d>& cameras) {
  switch (gauge.kind) {
    case GaugeKind::kGeoreferenced:
      return UtmFrame(gauge.origin);
    case GaugeKind::kMetric:
      return TurnedFrame(SE3(), "the map's metres, z up");
    case GaugeKind::kFree:
      break;
  }
  return TurnedFrame(LevelFromWorld(points, cameras),
                     "the map's own unit, turned so that the ground is level");
}

}  // namespace deepuav
