#include "deepuav/sensors/georeference_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kMaxSteps = 20;
constexpr double kConverged = 1e-10;

using Vector1d = Eigen::Matrix<double, 1, 1>;

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
                                               const PlacePriors& known)
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
  for (size_t i = 0; i < positions_.size(); ++i) {
    const SE3& camera = positions_[i].camera.world_from_cam;
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
  AddPriors(estimate, &normal);
  return normal;
}

void GeoreferenceRefinement::AddPriors(const PathEstimate& estimate, Normal* normal) const {
  if (known_.orientation) {
    AddOrientation(*known_.orientation, estimate.local_from_world, normal);
  } else {
    AddLevels(estimate.local_from_world, normal);
  }
  Eigen::Matrix<double, 1, 8> offset = Eigen::Matrix<double, 1, 8>::Zero();
  const double per_sigma = clock_.sigma_s > 0 ? 1 / clock_.sigma_s : 1e6;
  offset[kClockOffset] = per_sigma;
  const double away_s = placed_offset_s_ + estimate.clock_shift_s - clock_.offset_s;
  normal->Add<1>(offset, Vector1d(per_sigma * away_s));
  if (known_.metric) AddMetric(*known_.metric, estimate.local_from_world, normal);
}

/// That each camera's x axis is level, all together as sure as one: the axes' mean would say
/// nothing of a flight there and back.
void GeoreferenceRefinement::AddLevels(const Sim3& local_from_world, Normal* normal) const {
  const double sigma = level_sigma_ * std::sqrt(static_cast<double>(positions_.size()));
  for (const PositionOnPath& at : positions_) {
    const Eigen::Vector3d side = local_from_world.rotation() *
                                 (at.camera.world_from_cam.rotation() * Eigen::Vector3d::UnitX());
    Eigen::Matrix<double, 1, 8> level = Eigen::Matrix<double, 1, 8>::Zero();
    level.segment<3>(kTurn) = side.cross(Eigen::Vector3d::UnitZ()).transpose() / sigma;
    normal->Add<1>(level, Vector1d(side.z() / sigma));
  }
}

void GeoreferenceRefinement::AddMetric(const MetricPrior& known, const Sim3& local_from_world,
                                       Normal* normal) {
  Eigen::Matrix<double, 1, 8> scale = Eigen::Matrix<double, 1, 8>::Zero();
  scale[kLogScale] = 1 / known.scale_sigma;
  normal->Add<1>(scale, Vector1d(std::log(local_from_world.scale()) / known.scale_sigma));
  AddUp(local_from_world.rotation() * Eigen::Vector3d::UnitZ(), known.tilt_sigma_rad, normal);
}

void GeoreferenceRefinement::AddOrientation(const OrientationPrior& known,
                                            const Sim3& local_from_world, Normal* normal) {
  const Eigen::Quaterniond turn = local_from_world.rotation() * known.local_from_world.conjugate();
  AddUp(turn * Eigen::Vector3d::UnitZ(), known.tilt_sigma_rad, normal);
  const Eigen::Vector3d east = turn * Eigen::Vector3d::UnitX();
  Eigen::Matrix<double, 1, 8> heading = Eigen::Matrix<double, 1, 8>::Zero();
  heading[kTurn + 2] = 1 / known.heading_sigma_rad;
  normal->Add<1>(heading, Vector1d(std::atan2(east.y(), east.x()) / known.heading_sigma_rad));
}

/// That what was up is up.
void GeoreferenceRefinement::AddUp(const Eigen::Vector3d& up, double sigma_rad, Normal* normal) {
  Eigen::Matrix<double, 2, 8> tilt = Eigen::Matrix<double, 2, 8>::Zero();
  tilt.middleCols<3>(kTurn) = -Skew(up).topRows<2>() / sigma_rad;
  normal->Add<2>(tilt, up.head<2>() / sigma_rad);
}

}  // namespace deepuav
