#include "deepuav/sensors/georeference_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kMaxSteps = 20;
constexpr double kConverged = 1e-10;

}  // namespace

/// The information that weighted positions and the priors give, and the gradient.
struct GeoreferenceRefinement::Normal {
  Matrix8d information = Matrix8d::Zero();
  Vector8d gradient = Vector8d::Zero();

  template <int kRows>
  void Add(const Eigen::Matrix<double, kRows, 8>& jacobian,
           const Eigen::Matrix<double, kRows, 1>& residual) {
    information.noalias() += jacobian.transpose() * jacobian;
    gradient.noalias() += jacobian.transpose() * residual;
  }
};

GeoreferenceRefinement::GeoreferenceRefinement(const PathPositions& positions,
                                               const Eigen::Vector3d& antenna_cam_m,
                                               const ClockPrior& clock, double placed_offset_s,
                                               const GeoreferenceOptions& options,
                                               const MetricPrior* known)
    : positions_(positions),
      antenna_cam_m_(antenna_cam_m),
      clock_(clock),
      placed_offset_s_(placed_offset_s),
      level_sigma_(options.level_sigma_deg * kDegree),
      known_(known) {}

Matrix8d GeoreferenceRefinement::Information(const PathEstimate& estimate,
                                             const std::vector<Eigen::Vector3d>& per_sigma) const {
  return Linearise(estimate, per_sigma).information;
}

PathEstimate GeoreferenceRefinement::Solve(PathEstimate estimate,
                                           const std::vector<Eigen::Vector3d>& per_sigma) const {
  for (int step = 0; step < kMaxSteps; ++step) {
    const Normal normal = Linearise(estimate, per_sigma);
    const Vector8d change = -normal.information.ldlt().solve(normal.gradient);
    if (!change.allFinite()) break;
    const Sim3& local = estimate.local_from_world;
    estimate.local_from_world =
        Sim3(local.scale() * std::exp(std::clamp(change[kLogScale], -1.0, 1.0)),
             RotationExp(change.segment<3>(kTurn)) * local.rotation(),
             local.translation() + change.segment<3>(kShift));
    if (clock_.sigma_s > 0) estimate.clock_shift_s += change[kClockOffset];
    if (change.norm() < kConverged) break;
  }
  return estimate;
}

GeoreferenceRefinement::Normal GeoreferenceRefinement::Linearise(
    const PathEstimate& estimate, const std::vector<Eigen::Vector3d>& per_sigma) const {
  Normal normal;
  const Sim3& local = estimate.local_from_world;
  Eigen::Vector3d side = Eigen::Vector3d::Zero();  // The mean of the cameras' x axes.
  for (size_t i = 0; i < positions_.size(); ++i) {
    const SE3& camera = positions_[i].camera.world_from_cam;
    side += local.rotation() * (camera.rotation() * Eigen::Vector3d::UnitX());
    if (per_sigma[i].isZero()) continue;
    Eigen::Matrix<double, 3, 8> jacobian;
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // A clock that is known does not move.
    if (clock_.sigma_s > 0)
      velocity = local.scale() * (local.rotation() * positions_[i].velocity_world);
    const Eigen::Vector3d path =
        local * (camera.translation() + estimate.clock_shift_s * positions_[i].velocity_world) -
        local.translation();
    const Eigen::Vector3d arm = local.rotation() * (camera.rotation() * antenna_cam_m_);
    jacobian << -Skew(path + arm), Eigen::Matrix3d::Identity(), path, velocity;
    normal.Add<3>(
        per_sigma[i].asDiagonal() * jacobian,
        per_sigma[i].cwiseProduct(AntennaResidual(estimate, positions_[i], antenna_cam_m_)));
  }
  AddPriors(estimate, side / static_cast<double>(positions_.size()), &normal);
  return normal;
}

void GeoreferenceRefinement::AddPriors(const PathEstimate& estimate, const Eigen::Vector3d& side,
                                       Normal* normal) const {
  Eigen::Matrix<double, 1, 8> level = Eigen::Matrix<double, 1, 8>::Zero();
  level.segment<3>(kTurn) = side.cross(Eigen::Vector3d::UnitZ()).transpose() / level_sigma_;
  normal->Add<1>(level, Eigen::Matrix<double, 1, 1>(side.z() / level_sigma_));
  Eigen::Matrix<double, 1, 8> offset = Eigen::Matrix<double, 1, 8>::Zero();
  const double per_sigma = clock_.sigma_s > 0 ? 1 / clock_.sigma_s : 1e6;
  offset[kClockOffset] = per_sigma;
  const double away_s = placed_offset_s_ + estimate.clock_shift_s - clock_.offset_s;
  normal->Add<1>(offset, Eigen::Matrix<double, 1, 1>(per_sigma * away_s));
  if (known_) AddKnown(estimate.local_from_world, normal);
}

void GeoreferenceRefinement::AddKnown(const Sim3& local_from_world, Normal* normal) const {
  Eigen::Matrix<double, 1, 8> scale = Eigen::Matrix<double, 1, 8>::Zero();
  scale[kLogScale] = 1 / known_->scale_sigma;
  normal->Add<1>(
      scale, Eigen::Matrix<double, 1, 1>(std::log(local_from_world.scale()) / known_->scale_sigma));
  const Eigen::Vector3d up = local_from_world.rotation() * Eigen::Vector3d::UnitZ();
  Eigen::Matrix<double, 2, 8> tilt = Eigen::Matrix<double, 2, 8>::Zero();
  tilt.middleCols<3>(kTurn) = -Skew(up).topRows<2>() / known_->tilt_sigma_rad;
  normal->Add<2>(tilt, up.head<2>() / known_->tilt_sigma_rad);
}

}  // namespace deepuav
