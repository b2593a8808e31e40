#include "deepuav/estimation/bundle/bundle_linearisation.h"

#include <algorithm>

namespace deepuav {
namespace {

/// The squared error at which an observation stops to count: that of 45 degrees, in standard
/// deviations. One behind its camera counts as much, so that the cost is continuous where a
/// landmark passes the plane of the camera.
double MaxSquaredError(const BundleCamera& camera, const Whitening& whitening) {
  return camera.pinhole.fx * camera.pinhole.fx * whitening.MeanSquaredGain();
}

/// Poses as matrices: a rotation is applied to hundreds of points.
struct PoseMatrix {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
};

std::vector<PoseMatrix> PoseMatrices(const std::vector<SE3>& poses) {
  std::vector<PoseMatrix> matrices(poses.size());
  for (size_t i = 0; i < poses.size(); ++i)
    matrices[i] = {poses[i].RotationMatrix(), poses[i].translation()};
  return matrices;
}

void MaskUnrefined(const RefinedCalibration& refined, Matrix2Calibration* jacobian) {
  for (int parameter = 0; parameter < kCalibrationParameters; ++parameter) {
    if (!refined.Has(parameter)) jacobian->col(parameter).setZero();
  }
}

/// By parameter; 0 for those of which the prior says nothing.
VectorCalibration PerSigma(const SmallPrior& prior) {
  VectorCalibration per_sigma = VectorCalibration::Zero();
  per_sigma[kRadial1] = prior.per_k1_sigma;
  per_sigma[kRadial2] = prior.per_k2_sigma;
  per_sigma[kTangential1] = per_sigma[kTangential2] = prior.per_tangential_sigma;
  per_sigma[kReadout] = prior.per_readout_sigma_s;
  return per_sigma;
}

/// What the prior knows to be small: what differs from its guess.
VectorCalibration SmallParameters(const SmallPrior& prior, const BundleCamera& camera) {
  VectorCalibration small = VectorCalibration::Zero();
  small[kRadial1] = camera.k1 - prior.radial_guess.x();
  small[kRadial2] = camera.k2 - prior.radial_guess.y();
  small[kTangential1] = camera.p1;
  small[kTangential2] = camera.p2;
  small[kReadout] = camera.readout_s;
  return small;
}

/// sum += a^T b, column by column: Eigen's own product of matrices of this shape calls a function
/// for each coefficient.
template <int kA, int kB, int kOptionsA, int kOptionsB>
void AddProduct(const Eigen::Matrix<double, 2, kA, kOptionsA>& a,
                const Eigen::Matrix<double, 2, kB, kOptionsB>& b,
                Eigen::Matrix<double, kA, kB>* sum) {
  const Eigen::Matrix<double, kA, 1> first = a.row(0).transpose(), second = a.row(1).transpose();
  for (int column = 0; column < kB; ++column)
    sum->col(column) += b(0, column) * first + b(1, column) * second;
}

template <typename Block>
void AssignZero(size_t count, std::vector<Block>* blocks) {
  blocks->assign(count, Block::Zero());
}

}  // namespace

/// Where a linearisation is made.
struct BundleLinearisation::At {
  const BundleStructure& structure;
  const BundleState& state;
  const HuberLoss& loss;
  const RefinedCalibration& refined;
  std::vector<PoseMatrix> poses;
};

void BundleLinearisation::Compute(const BundleStructure& structure, const BundleState& state,
                                  const HuberLoss& loss, const RefinedCalibration& refined,
                                  int threads) {
  landmark_landmark.resize(structure.groups());
  landmark_gradient.resize(structure.groups());
  camera_landmark.resize(structure.observations.size());
  has_calibration = refined.any();
  calibration_landmark.resize(has_calibration ? structure.groups() : 0);
  const At at{structure, state, loss, refined, PoseMatrices(state.cam_from_world)};
  const int parts = structure.parts();
  parts_.resize(parts);
  ForEachInParallel(parts, threads, [&](int part) {
    ComputePart(at, PartOf(structure.groups(), part, parts), &parts_[part]);
  });
  AddUp(parts_);
  camera_pair = structure.camera_pairs;
  CameraFactorLinearisation(structure.free_of_camera)
      .Compute(structure.factors, state.cam_from_world, &camera_camera, &camera_gradient,
               &camera_pair);
  if (refined.focal) AddPrior(structure.focal_prior, state.camera.pinhole.fx);
  if (refined.centre) AddPrior(structure.centre_prior, state.camera.pinhole);
  AddPrior(structure.small_prior, state.camera);
}

void BundleLinearisation::ComputePart(const At& at, const PartOf& groups, Shared* shared) {
  const int cameras = at.structure.free_cameras();
  AssignZero(cameras, &shared->camera_camera);
  AssignZero(cameras, &shared->camera_gradient);
  AssignZero(has_calibration ? cameras : 0, &shared->camera_calibration);
  shared->calibration_calibration.setZero();
  shared->calibration_gradient.setZero();
  for (int group = groups.first; group < groups.last; ++group) {
    landmark_landmark[group].setZero();
    landmark_gradient[group].setZero();
    if (has_calibration) calibration_landmark[group].setZero();
    for (int i = at.structure.group_begin[group]; i < at.structure.group_begin[group + 1]; ++i)
      AddObservation(at, i, shared);
  }
}

void BundleLinearisation::AddObservation(const At& at, size_t i, Shared* shared) {
  const GroupedObservation& o = at.structure.observations[i];
  const BundleCamera& camera = at.state.camera;
  const PoseMatrix& pose = at.poses[o.camera];
  const Eigen::Vector3d still =
      pose * at.state.landmarks_world[at.structure.landmark_of_group[o.group]];
  const Eigen::Vector3d point = still + camera.readout_s * o.drift_cam_per_s;
  const Eigen::Vector2d error_px = camera.Project(point) - o.px;
  const Eigen::Vector2d error = o.whitening * error_px;
  const double squared = error.squaredNorm();
  if (!InFrontOfCamera(point) || squared > MaxSquaredError(camera, o.whitening)) {
    camera_landmark[i].setZero();
    return;
  }
  const double weight = at.loss.Weight(squared);
  const Eigen::Vector2d weighted_error = weight * error;
  const Matrix23d point_jacobian = o.whitening * camera.PointJacobian(point);
  const Matrix23d landmark_jacobian = point_jacobian * pose.rotation;
  const Matrix23d weighted = weight * landmark_jacobian;
  AddProduct(landmark_jacobian, weighted, &landmark_landmark[o.group]);
  AddProduct(landmark_jacobian, weighted_error, &landmark_gradient[o.group]);

  const Matrix26d camera_jacobian = PoseJacobian(point_jacobian, still);
  if (o.free_camera >= 0) {
    const Matrix26d weighted_camera = weight * camera_jacobian;
    AddProduct(camera_jacobian, weighted_camera, &shared->camera_camera[o.free_camera]);
    AddProduct(camera_jacobian, weighted_error, &shared->camera_gradient[o.free_camera]);
    camera_landmark[i].setZero();
    AddProduct(camera_jacobian, weighted, &camera_landmark[i]);
  }
  if (!has_calibration) return;
  Matrix2Calibration jacobian = o.whitening * camera.CalibrationJacobian(point);
  jacobian.col(kReadout) = point_jacobian * o.drift_cam_per_s;
  MaskUnrefined(at.refined, &jacobian);
  const Matrix2Calibration weighted_calibration = weight * jacobian;
  AddProduct(jacobian, weighted_calibration, &shared->calibration_calibration);
  AddProduct(jacobian, weighted_error, &shared->calibration_gradient);
  AddProduct(jacobian, weighted, &calibration_landmark[o.group]);
  if (o.free_camera >= 0)
    AddProduct(camera_jacobian, weighted_calibration, &shared->camera_calibration[o.free_camera]);
}

void BundleLinearisation::AddUp(const std::vector<Shared>& parts) {
  camera_camera = parts.front().camera_camera;
  camera_gradient = parts.front().camera_gradient;
  camera_calibration = parts.front().camera_calibration;
  calibration_calibration = parts.front().calibration_calibration;
  calibration_gradient = parts.front().calibration_gradient;
  for (size_t part = 1; part < parts.size(); ++part) {
    const Shared& more = parts[part];
    for (size_t i = 0; i < camera_camera.size(); ++i) {
      camera_camera[i] += more.camera_camera[i];
      camera_gradient[i] += more.camera_gradient[i];
    }
    for (size_t i = 0; i < camera_calibration.size(); ++i)
      camera_calibration[i] += more.camera_calibration[i];
    calibration_calibration += more.calibration_calibration;
    calibration_gradient += more.calibration_gradient;
  }
}

void BundleLinearisation::AddPrior(const FocalPrior& prior, double fx) {
  calibration_calibration(kFocalScale, kFocalScale) += prior.per_sigma * prior.per_sigma;
  calibration_gradient[kFocalScale] += prior.per_sigma * prior.Error(fx);
}

void BundleLinearisation::AddPrior(const CentrePrior& prior, const Pinhole& pinhole) {
  const double per_step = prior.per_sigma_px * pinhole.fx;
  calibration_calibration(kCentreX, kCentreX) += per_step * per_step;
  calibration_calibration(kCentreY, kCentreY) += per_step * per_step;
  calibration_gradient.segment<2>(kCentreX) += per_step * prior.Error(pinhole);
}

void BundleLinearisation::AddPrior(const SmallPrior& prior, const BundleCamera& camera) {
  const VectorCalibration per_sigma = PerSigma(prior);
  calibration_calibration.diagonal() += per_sigma.cwiseAbs2();
  calibration_gradient += per_sigma.cwiseAbs2().cwiseProduct(SmallParameters(prior, camera));
}

double BundleCost(const BundleStructure& structure, const BundleState& state, const HuberLoss& loss,
                  int threads) {
  const std::vector<PoseMatrix> poses = PoseMatrices(state.cam_from_world);
  const double prior = structure.focal_prior.Error(state.camera.pinhole.fx);
  const VectorCalibration small =
      PerSigma(structure.small_prior)
          .cwiseProduct(SmallParameters(structure.small_prior, state.camera));
  double cost = prior * prior + small.squaredNorm() +
                structure.centre_prior.Error(state.camera.pinhole).squaredNorm() +
                CameraFactorCost(structure.factors, state.cam_from_world);
  const auto cost_of = [&](const GroupedObservation& o) {
    const Eigen::Vector3d point =
        poses[o.camera] * state.landmarks_world[structure.landmark_of_group[o.group]] +
        state.camera.readout_s * o.drift_cam_per_s;
    double squared = MaxSquaredError(state.camera, o.whitening);
    if (InFrontOfCamera(point)) {
      const Eigen::Vector2d error_px = state.camera.Project(point) - o.px;
      squared = std::min(squared, (o.whitening * error_px).squaredNorm());
    }
    return loss.Cost(squared);
  };
  const int parts = structure.parts();
  const auto observations = static_cast<int>(structure.observations.size());
  std::vector<double> sums(parts, 0);
  ForEachInParallel(parts, threads, [&](int part) {
    const PartOf range(observations, part, parts);
    double sum = 0;
    for (int i = range.first; i < range.last; ++i) sum += cost_of(structure.observations[i]);
    sums[part] = sum;
  });
  for (const double sum : sums) cost += sum;
  return cost;
}

}  // namespace deepuav
