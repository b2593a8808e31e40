#include "deepuav/system/sensors/running_place.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/sensors/known_place.h"

namespace deepuav {
namespace {

/// By how much surer of the camera's place what is found must be to be told anew, and how many
/// standard deviations from where it was told to be.
constexpr double kSurer = 1.2, kContradiction = 3;

double HorizontalSigma(const Georeference& place, const Eigen::Vector3d& world) {
  return std::sqrt(place.PositionCovariance(world).topLeftCorner<2, 2>().trace());
}

GeoreferenceOptions Stricter(GeoreferenceOptions options) {
  constexpr double kDegree = M_PI / 180;
  options.max_scale_sigma = std::min(options.max_scale_sigma, options.running_max_sigma);
  options.max_turn_sigma_deg =
      std::min(options.max_turn_sigma_deg, options.running_max_sigma / kDegree);
  return options;
}

/// The place of the world that the path was moved from.
Georeference Before(const Sim3& new_from_old, Georeference found) {
  found.local_from_world = found.local_from_world * new_from_old;
  return found;
}

}  // namespace

RunningPlace::RunningPlace(const GnssStream& gnss, const SensorUseOptions& options)
    : antenna_cam_m_(gnss.antenna_cam_m),
      clock_{options.gnss_clock_offset_s, options.search_gnss_clock ? gnss.clock_sigma_s : 0},
      noise_(options.gnss),
      options_(Stricter(options.georeference)) {}

GeoreferenceAttempt RunningPlace::Attempt(const Trajectory& path,
                                          const std::vector<LocalFix>& fixes,
                                          const PlacePriors& known) const {
  return FindGeoreference(path, fixes, antenna_cam_m_, clock_, noise_, options_, known);
}

GeoreferenceAttempt RunningPlace::Attempt(const Evidence& evidence,
                                          const std::vector<LocalFix>& fixes) const {
  if (!evidence.metric) return Attempt(evidence.path, fixes, {});
  const Sim3& metric_from_world = evidence.metric->metric_from_world;
  const Trajectory path = MoveTrajectory(metric_from_world, evidence.path);
  const MetricPrior metric{evidence.metric->scale_sigma, evidence.metric->tilt_sigma_rad};
  const GeoreferenceAttempt by_fixes = Attempt(path, fixes, {.metric = kRoughlyUp});
  const bool contradict =
      by_fixes.found && Contradiction(*by_fixes.found, metric) > kContradictionSigmas;
  GeoreferenceAttempt attempt = contradict ? by_fixes : Attempt(path, fixes, {.metric = metric});
  if (attempt.found) attempt.found = Before(metric_from_world, *attempt.found);
  return attempt;
}

std::optional<PlacedWorld> RunningPlace::Find(const Evidence& evidence) {
  const std::vector<LocalFix> fixes = LocalFixes(evidence.fixes, evidence.origin, noise_);
  const GeoreferenceAttempt attempt = Attempt(evidence, fixes);
  refusal_ = attempt.reason;
  const bool origin_moves = told_ && origin_ != evidence.origin;
  if (origin_moves) {
    told_->local_from_world =
        Sim3(LocalFromLocal(evidence.origin, origin_)) * told_->local_from_world;
  }
  origin_ = evidence.origin;
  const bool is_news = attempt.found && IsNews(*attempt.found, evidence.camera_world);
  if (is_news) told_ = attempt.found;
  if (!is_news && !origin_moves) return std::nullopt;
  return Told(evidence.camera_world);
}

PlacedWorld RunningPlace::Told(const Eigen::Vector3d& camera_world) const {
  return {told_->local_from_world, origin_, told_->covariance.topLeftCorner<7, 7>(),
          HorizontalSigma(*told_, camera_world), told_->used()};
}

bool RunningPlace::IsNews(const Georeference& found, const Eigen::Vector3d& camera_world) const {
  if (!told_) return true;
  const double told_sigma_m = HorizontalSigma(*told_, camera_world);
  const double sigma_m = HorizontalSigma(found, camera_world);
  if (kSurer * sigma_m <= told_sigma_m) return true;
  const Eigen::Vector3d moved =
      found.local_from_world * camera_world - told_->local_from_world * camera_world;
  const Eigen::Matrix3d covariance =
      found.PositionCovariance(camera_world) + told_->PositionCovariance(camera_world);
  return moved.dot(covariance.llt().solve(moved)) > kContradiction * kContradiction;
}

}  // namespace deepuav
