#include "deepuav/estimation/bundle_linearization.h"

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

VectorCalibration SmallParameters(const BundleCamera& camera) {
  VectorCalibration small = VectorCalibration::Zero();
  small[kRadial1] = camera.k1;
  small[kRadial2] = camera.k2;
  small[kTangential1] = camera.p1;
  small[kTangential2] = camera.p2;
  small[kReadout] = camera.readout_s;
  return small;
}

template <typename Block>
void AssignZero(size_t count, std::vector<Block>* blocks) {
  blocks->assign(count, Block::Zero());
}

}  // namespace

void BundleLinearization::Compute(const BundleStructure& structure, const BundleState& state,
                                  const HuberLoss& loss, const RefinedCalibration& refined) {
  AssignZero(structure.free_cameras(), &camera_camera);
  AssignZero(structure.free_cameras(), &camera_gradient);
  AssignZero(structure.groups(), &landmark_landmark);
  AssignZero(structure.groups(), &landmark_gradient);
  camera_landmark.resize(structure.observations.size());
  has_calibration = refined.any();
  calibration_calibration.setZero();
  calibration_gradient.setZero();
  AssignZero(has_calibration ? structure.free_cameras() : 0, &camera_calibration);
  AssignZero(has_calibration ? structure.groups() : 0, &calibration_landmark);

  const std::vector<PoseMatrix> poses = PoseMatrices(state.cam_from_world);
  for (size_t i = 0; i < structure.observations.size(); ++i) {
    const GroupedObservation& o = structure.observations[i];
    const PoseMatrix& pose = poses[o.camera];
    const Eigen::Vector3d still =
        pose * state.landmarks_world[structure.landmark_of_group[o.group]];
    const Eigen::Vector3d point = still + state.camera.readout_s * o.drift_cam_per_s;
    const Eigen::Vector2d error_px = state.camera.Project(point) - o.px;
    const Eigen::Vector2d error = o.whitening * error_px;
    const double squared = error.squaredNorm();
    if (!InFrontOfCamera(point) || squared > MaxSquaredError(state.camera, o.whitening)) {
      camera_landmark[i].setZero();
      continue;
    }
    const double weight = loss.Weight(squared);
    const Matrix23d point_jacobian = o.whitening * state.camera.PointJacobian(point);
    const Matrix23d landmark_jacobian = point_jacobian * pose.rotation;
    const Matrix23d weighted = weight * landmark_jacobian;
    landmark_landmark[o.group].noalias() += landmark_jacobian.transpose() * weighted;
    landmark_gradient[o.group].noalias() += weighted.transpose() * error;

    const Matrix26d camera_jacobian = PoseJacobian(point_jacobian, still);
    if (o.free_camera >= 0) {
      const Matrix26d weighted_camera = weight * camera_jacobian;
      camera_camera[o.free_camera].noalias() += camera_jacobian.transpose() * weighted_camera;
      camera_gradient[o.free_camera].noalias() += weighted_camera.transpose() * error;
      camera_landmark[i].noalias() = camera_jacobian.transpose() * weighted;
    }
    if (!has_calibration) continue;
    Matrix2Calibration jacobian = o.whitening * state.camera.CalibrationJacobian(point);
    jacobian.col(kReadout) = point_jacobian * o.drift_cam_per_s;
    MaskUnrefined(refined, &jacobian);
    calibration_calibration.noalias() += weight * jacobian.transpose() * jacobian;
    calibration_gradient.noalias() += weight * jacobian.transpose() * error;
    calibration_landmark[o.group].noalias() += jacobian.transpose() * weighted;
    if (o.free_camera >= 0) {
      camera_calibration[o.free_camera].noalias() +=
          weight * camera_jacobian.transpose() * jacobian;
    }
  }
  camera_pair = structure.camera_pairs;
  CameraFactorLinearization(structure.free_of_camera)
      .Compute(structure.factors, state.cam_from_world, &camera_camera, &camera_gradient,
               &camera_pair);
  if (refined.focal) AddPrior(structure.focal_prior, state.camera.pinhole.fx);
  if (refined.centre) AddPrior(structure.centre_prior, state.camera.pinhole);
  AddPrior(structure.small_prior, state.camera);
}

void BundleLinearization::AddPrior(const FocalPrior& prior, double fx) {
  calibration_calibration(kFocalScale, kFocalScale) += prior.per_sigma * prior.per_sigma;
  calibration_gradient[kFocalScale] += prior.per_sigma * prior.Error(fx);
}

void BundleLinearization::AddPrior(const CentrePrior& prior, const Pinhole& pinhole) {
  const double per_step = prior.per_sigma_px * pinhole.fx;
  calibration_calibration(kCentreX, kCentreX) += per_step * per_step;
  calibration_calibration(kCentreY, kCentreY) += per_step * per_step;
  calibration_gradient.segment<2>(kCentreX) += per_step * prior.Error(pinhole);
}

void BundleLinearization::AddPrior(const SmallPrior& prior, const BundleCamera& camera) {
  const VectorCalibration per_sigma = PerSigma(prior);
  calibration_calibration.diagonal() += per_sigma.cwiseAbs2();
  calibration_gradient += per_sigma.cwiseAbs2().cwiseProduct(SmallParameters(camera));
}

double BundleCost(const BundleStructure& structure, const BundleState& state,
                  const HuberLoss& loss) {
  const std::vector<PoseMatrix> poses = PoseMatrices(state.cam_from_world);
  const double prior = structure.focal_prior.Error(state.camera.pinhole.fx);
  const VectorCalibration small =
      PerSigma(structure.small_prior).cwiseProduct(SmallParameters(state.camera));
  double cost = prior * prior + small.squaredNorm() +
                structure.centre_prior.Error(state.camera.pinhole).squaredNorm() +
                CameraFactorCost(structure.factors, state.cam_from_world);
  for (const GroupedObservation& o : structure.observations) {
    const Eigen::Vector3d point =
        poses[o.camera] * state.landmarks_world[structure.landmark_of_group[o.group]] +
        state.camera.readout_s * o.drift_cam_per_s;
    double squared = MaxSquaredError(state.camera, o.whitening);
    if (InFrontOfCamera(point)) {
      const Eigen::Vector2d error_px = state.camera.Project(point) - o.px;
      squared = std::min(squared, (o.whitening * error_px).squaredNorm());
    }
    cost += loss.Cost(squared);
  }
  return cost;
}

}  // namespace deepuav
