#include "deepuav/inertial/alignment/mount_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/base/median.h"
#include "deepuav/inertial/paths/path_steps.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
/// Long enough that the noise of two poses does not hide the turn between them.
constexpr double kStep_s = 0.2;
constexpr size_t kMinSteps = 15;
constexpr double kClockStep_s = 0.005;
constexpr int kRounds = 5;
/// Below it errors of the turns are rounding.
constexpr double kMinError_rad_s = 1e-6;
/// A mount counts as along the axes that lies so many standard deviations from there, at most.
constexpr double kNearSigmas = 3;

/// Mean angular velocities between two poses, as camera and gyroscope have them, in their own axes.
struct TurnPair {
  Eigen::Vector3d camera_rad_s, imu_rad_s;
};

std::vector<TurnPair> TurnPairs(const Trajectory& path, const ImuIntegrator& imu,
                                const InertialOptions& options, double clock_offset_s) {
  std::vector<TurnPair> pairs;
  for (const PathStep& step :
       StepsAlong(path, imu, kStep_s, options.max_path_gap_s, clock_offset_s, {})) {
    const Eigen::Quaterniond turn =
        step.first->world_from_cam.rotation().conjugate() * step.last->world_from_cam.rotation();
    pairs.push_back({RotationLog(turn) / step.motion.duration_s,
                     RotationLog(step.motion.rotation) / step.motion.duration_s});
  }
  return pairs;
}

struct MountFit {
  Eigen::Matrix3d cam_from_imu = Eigen::Matrix3d::Identity();
  double misfit_rad_s = std::numeric_limits<double>::infinity();  ///< Root mean square.
  double sigma_rad = std::numeric_limits<double>::infinity();
};

/// The weighted pairs without their means, which hold the gyroscope's bias.
std::vector<TurnPair> Centred(const std::vector<TurnPair>& pairs,
                              const std::vector<double>& weights) {
  TurnPair mean{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double sum = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    mean.camera_rad_s += weights[i] * pairs[i].camera_rad_s;
    mean.imu_rad_s += weights[i] * pairs[i].imu_rad_s;
    sum += weights[i];
  }
  std::vector<TurnPair> centred = pairs;
  for (TurnPair& pair : centred) {
    pair.camera_rad_s -= mean.camera_rad_s / sum;
    pair.imu_rad_s -= mean.imu_rad_s / sum;
  }
  return centred;
}

Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d &u = svd.matrixU(), &v = svd.matrixV();
  const Eigen::Vector3d handed(1, 1, (u * v.transpose()).determinant() < 0 ? -1 : 1);
  return u * handed.asDiagonal() * v.transpose();
}

/// About the axis that the turns leave most open.
double SigmaOf(const std::vector<TurnPair>& centred, const std::vector<double>& weights,
               const Eigen::Matrix3d& cam_from_imu, double variance) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < centred.size(); ++i) {
    const Eigen::Vector3d turn = cam_from_imu * centred[i].imu_rad_s;
    information += weights[i] / variance *
                   (turn.squaredNorm() * Eigen::Matrix3d::Identity() - turn * turn.transpose());
  }
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(information).eigenvalues().minCoeff();
  return least > 0 ? 1 / std::sqrt(least) : std::numeric_limits<double>::infinity();
}

MountFit FitMount(const std::vector<TurnPair>& pairs) {
  MountFit fit;
  if (pairs.size() < kMinSteps) return fit;
  std::vector<double> weights(pairs.size(), 1);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<TurnPair> centred = Centred(pairs, weights);
    Eigen::Matrix3d common = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < centred.size(); ++i)
      common += weights[i] * centred[i].camera_rad_s * centred[i].imu_rad_s.transpose();
    fit.cam_from_imu = NearestRotation(common);
    std::vector<double> errors;
    double squares = 0, sum = 0;
    for (size_t i = 0; i < centred.size(); ++i) {
      errors.push_back((centred[i].camera_rad_s - fit.cam_from_imu * centred[i].imu_rad_s).norm());
      squares += weights[i] * errors.back() * errors.back();
      sum += weights[i];
    }
    fit.misfit_rad_s = std::max(std::sqrt(squares / sum), kMinError_rad_s);
    fit.sigma_rad =
        SigmaOf(centred, weights, fit.cam_from_imu, fit.misfit_rad_s * fit.misfit_rad_s / 3);
    const double usual = std::max(Median(errors), kMinError_rad_s);
    for (size_t i = 0; i < errors.size(); ++i)
      weights[i] = std::pow(std::min(1.0, 2 * usual / errors[i]), 2);
  }
  return fit;
}

/// The rotation of right angles that is nearest to another, and how far it is.
std::pair<Eigen::Matrix3d, double> AlongAxes(const Eigen::Matrix3d& rotation) {
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double most = -std::numeric_limits<double>::infinity();
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();
      for (int row = 0; row < 3; ++row)
        axes(row, order[static_cast<size_t>(row)]) = (signs >> row & 1) != 0 ? -1 : 1;
      const double trace = (axes.transpose() * rotation).trace();
      if (axes.determinant() < 0 || trace <= most) continue;
      most = trace;
      best = axes;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return {best, std::acos(std::clamp((most - 1) / 2, -1.0, 1.0))};
}

}  // namespace

std::optional<FoundMount> FindMount(const Trajectory& path, const ImuIntegrator& imu,
                                    const InertialOptions& options) {
  MountFit fit;
  double best = std::numeric_limits<double>::infinity(), clock_offset_s = 0;
  const int reach = static_cast<int>(std::floor(options.max_clock_offset_s / kClockStep_s));
  for (int i = -reach; i <= reach; ++i) {
    const double offset_s = kClockStep_s * i;
    const MountFit here = FitMount(TurnPairs(path, imu, options, offset_s));
    if (!(here.misfit_rad_s < best)) continue;
    best = here.misfit_rad_s;
    fit = here;
    clock_offset_s = offset_s;
  }
  const auto [axes, away_rad] = AlongAxes(fit.cam_from_imu);
  const double axes_sigma_rad = options.aligned_mount_sigma_deg * kDegree;
  if (fit.sigma_rad <= options.max_mount_doubt_deg * kDegree && fit.sigma_rad > axes_sigma_rad &&
      away_rad <= kNearSigmas * fit.sigma_rad) {
    return FoundMount{Eigen::Quaterniond(axes), axes_sigma_rad, true, clock_offset_s};
  }
  if (!(fit.sigma_rad <= options.max_tilt_sigma_deg * kDegree)) return std::nullopt;
  return FoundMount{Eigen::Quaterniond(fit.cam_from_imu), fit.sigma_rad, false, clock_offset_s};
}

}  // namespace deepuav
