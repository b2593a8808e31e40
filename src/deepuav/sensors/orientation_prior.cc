#include "deepuav/sensors/orientation_prior.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr size_t kMostTried = 100;  // Orientations, each as the one that the others agree with.

using Orientations = std::vector<Eigen::Quaterniond>;

/// local_from_world by each image of the path that has an attitude.
Orientations OrientationsBy(const Trajectory& path, const std::vector<AttitudeSample>& attitudes) {
  Orientations orientations;
  auto next = attitudes.begin();
  for (const TimedPose& pose : path) {
    while (next != attitudes.end() && next->time < pose.time) ++next;
    if (next == attitudes.end()) break;
    if (next->time == pose.time)
      orientations.push_back(next->enu_from_cam * pose.world_from_cam.rotation().conjugate());
  }
  return orientations;
}

std::vector<double> TurnsFrom(const Eigen::Quaterniond& orientation, const Orientations& all) {
  std::vector<double> turns;
  turns.reserve(all.size());
  for (const Eigen::Quaterniond& other : all) turns.push_back(orientation.angularDistance(other));
  return turns;
}

std::ptrdiff_t Within(const std::vector<double>& turns, double most_rad) {
  return std::ranges::count_if(turns, [&](double turn) { return turn <= most_rad; });
}

/// The one that most others are near to.
Eigen::Quaterniond MostAgreed(const Orientations& all, double most_rad) {
  const size_t stride = 1 + all.size() / kMostTried;
  std::ptrdiff_t most = 0;
  size_t best = 0;
  for (size_t i = 0; i < all.size(); i += stride) {
    const std::ptrdiff_t near = Within(TurnsFrom(all[i], all), most_rad);
    if (near > most) {
      most = near;
      best = i;
    }
  }
  return all[best];
}

/// The rotation nearest to all (Hartley et al. 2013, Rotation Averaging, chordal L2 mean).
Eigen::Quaterniond ChordalMean(const Orientations& all, const std::vector<double>& turns,
                               double most_rad) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < all.size(); ++i) {
    if (turns[i] <= most_rad) sum += all[i].toRotationMatrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return Eigen::Quaterniond(Eigen::Matrix3d(
      svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose()));
}

}  // namespace

void AttitudeNoise::Check() const { CheckOptions("sensors.attitude", *this); }

OrientationAttempt OrientationByAttitudes(const Trajectory& path,
                                          const std::vector<AttitudeSample>& attitudes,
                                          const AttitudeNoise& noise) {
  noise.Check();
  const Orientations all = OrientationsBy(path, attitudes);
  if (std::ssize(all) < noise.min_samples) {
    return {std::nullopt, fmt::format("{} images with angles lie on the path: expected at least {}",
                                      all.size(), noise.min_samples)};
  }
  const double most_rad = noise.max_spread_deg * kDegree;
  const Eigen::Quaterniond mean =
      ChordalMean(all, TurnsFrom(MostAgreed(all, most_rad), all), most_rad);
  const std::vector<double> turns = TurnsFrom(mean, all);
  const double agreeing = static_cast<double>(Within(turns, most_rad));
  if (agreeing < noise.min_agreeing * static_cast<double>(all.size())) {
    return {std::nullopt,
            fmt::format("the angles of {} of {} images agree within {:.0f} degrees: expected at "
                        "least {:.0f} %",
                        agreeing, all.size(), noise.max_spread_deg, 100 * noise.min_agreeing)};
  }
  const double of_mean_rad = Median(turns) / std::sqrt(agreeing);
  return {OrientationPrior{mean, std::hypot(noise.tilt_sigma_deg * kDegree, of_mean_rad),
                           std::hypot(noise.heading_sigma_deg * kDegree, of_mean_rad)},
          ""};
}

}  // namespace deepuav
