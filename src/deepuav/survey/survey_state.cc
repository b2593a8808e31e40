#include "deepuav/survey/survey_state.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/geometry/camera.h"

namespace deepuav {
namespace {

const double kWidestRay = std::tan(Camera::kMaxAngleRad);

double EndOf(const RadialPolynomial& radial) { return radial.OneToOneRadius(kWidestRay); }

Eigen::Vector2d TangentialShift(const BundleCamera& camera, const Eigen::Vector2d& ray) {
  const double x = ray.x(), y = ray.y(), squared = ray.squaredNorm();
  return {2 * camera.p1 * x * y + camera.p2 * (squared + 2 * x * x),
          camera.p1 * (squared + 2 * y * y) + 2 * camera.p2 * x * y};
}

}  // namespace

std::optional<Eigen::Vector3d> SurveyLens::Ray(const Eigen::Vector2d& px) const {
  const Eigen::Vector2d distorted = camera.pinhole.Unproject(px).head<2>();
  if (camera.IsUndistorted()) return distorted.homogeneous();
  const RadialPolynomial radial({camera.k1, camera.k2, 0, 0});
  const double end = EndOf(radial);
  Eigen::Vector2d ray = distorted;
  // Tangential distortion is small: taken away as it is where the ray was found before.
  constexpr int kTangentialRounds = 4;
  const bool is_plain = camera.p1 == 0 && camera.p2 == 0;
  for (int round = 0; round < (is_plain ? 1 : kTangentialRounds); ++round) {
    const Eigen::Vector2d bent = distorted - TangentialShift(camera, ray);
    const double radius = bent.norm();
    if (radius >= radial.Distort(end)) return std::nullopt;
    ray = radius == 0 ? bent : Eigen::Vector2d(radial.Invert(radius, end) / radius * bent);
  }
  return ray.homogeneous();
}

std::optional<Eigen::Vector2d> SurveyLens::Undistort(const Eigen::Vector2d& px) const {
  const auto ray = Ray(px);
  if (!ray) return std::nullopt;
  return camera.pinhole.Project(*ray);
}

bool SurveyLens::Reaches(const Eigen::Vector3d& point_cam) const {
  if (point_cam.z() <= 0) return false;
  if (camera.IsUndistorted()) return true;
  const RadialPolynomial radial({camera.k1, camera.k2, 0, 0});
  return radial.IsOneToOneAt(point_cam.hnormalized().norm(), kWidestRay);
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

bool SurveyState::HasViews(int at_least) const {
  int views = 0;
  for (size_t v = 0; v < cam_from_world.size() && views < at_least; ++v)
    views += cam_from_world[v].has_value();
  return views >= at_least;
}

Eigen::Vector3d SurveyState::DriftPerS(int view, double row_px) const {
  const auto v = static_cast<size_t>(view);
  if (v >= velocity_world.size()) return Eigen::Vector3d::Zero();
  const double from_middle = (row_px + 0.5) / image_rows - 0.5;
  return -from_middle * (cam_from_world[v]->rotation() * velocity_world[v]);
}

Eigen::Vector3d SurveyState::InCamera(const Eigen::Vector3d& point, int view, double row_px) const {
  return *cam_from_world[static_cast<size_t>(view)] * point +
         lens.camera.readout_s * DriftPerS(view, row_px);
}

double SquaredErrorPx(const BundleCamera& camera, const Eigen::Vector3d& point_cam,
                      const Eigen::Vector2d& px) {
  if (!InFrontOfCamera(point_cam)) return std::numeric_limits<double>::infinity();
  return (camera.Project(point_cam) - px).squaredNorm();
}

}  // namespace deepuav
