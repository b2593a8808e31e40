#include "deepuav/survey/survey_state.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/geometry/camera.h"

namespace deepuav {
namespace {

double EndOf(const RadialPolynomial& radial) {
  return radial.OneToOneRadius(std::tan(Camera::kMaxAngleRad));
}

}  // namespace

std::optional<Eigen::Vector3d> SurveyLens::Ray(const Eigen::Vector2d& px) const {
  const Eigen::Vector3d distorted = camera.pinhole.Unproject(px);
  if (camera.k1 == 0 && camera.k2 == 0) return distorted;
  const RadialPolynomial radial({camera.k1, camera.k2, 0, 0});
  const double end = EndOf(radial), radius = distorted.head<2>().norm();
  if (radius >= radial.Distort(end)) return std::nullopt;
  if (radius == 0) return distorted;
  const double factor = radial.Invert(radius, end) / radius;
  return Eigen::Vector3d(factor * distorted.x(), factor * distorted.y(), 1);
}

std::optional<Eigen::Vector2d> SurveyLens::Undistort(const Eigen::Vector2d& px) const {
  const auto ray = Ray(px);
  if (!ray) return std::nullopt;
  return camera.pinhole.Project(*ray);
}

bool SurveyLens::IsOneToOne(double radius_px) const {
  const RadialPolynomial radial({camera.k1, camera.k2, 0, 0});
  return radial.Distort(EndOf(radial)) * camera.pinhole.fx > radius_px;
}

SurveyState::SurveyState(const Tracks& tracks, size_t views, const SurveyLens& survey_lens)
    : lens(survey_lens), cam_from_world(views), points(tracks.tracks.size()) {
  agrees.reserve(tracks.tracks.size());
  for (const Track& track : tracks.tracks) agrees.emplace_back(track.sights.size(), 0);
}

int SurveyState::ViewCount() const {
  return static_cast<int>(std::count_if(cam_from_world.begin(), cam_from_world.end(),
                                        [](const auto& pose) { return pose.has_value(); }));
}

double SquaredErrorPx(const BundleCamera& camera, const SE3& cam_from_world,
                      const Eigen::Vector3d& point, const Eigen::Vector2d& px) {
  const Eigen::Vector3d point_cam = cam_from_world * point;
  if (!InFrontOfCamera(point_cam)) return std::numeric_limits<double>::infinity();
  return (camera.Project(point_cam) - px).squaredNorm();
}

}  // namespace deepuav
