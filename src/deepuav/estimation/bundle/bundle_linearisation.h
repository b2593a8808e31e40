#pragma once

#include <Eigen/Core>
#include <vector>

#include "deepuav/base/parallel.h"
#include "deepuav/estimation/bundle/bundle_camera.h"
#include "deepuav/estimation/bundle/bundle_structure.h"

namespace deepuav {

using Matrix63d = Eigen::Matrix<double, 6, 3>;
using Matrix6Calibration = Eigen::Matrix<double, 6, kCalibrationParameters>;
using MatrixCalibration3 = Eigen::Matrix<double, kCalibrationParameters, 3>;
using MatrixCalibration = Eigen::Matrix<double, kCalibrationParameters, kCalibrationParameters>;

/// The calibration parameters that move.
struct RefinedCalibration {
  bool focal = false, radial = false, centre = false, tangential = false, readout = false;
  bool any() const { return focal || radial || centre || tangential || readout; }
  /// Of a CalibrationParameter.
  bool Has(int parameter) const {
    switch (parameter) {
      case kFocalScale:
        return focal;
      case kRadial1:
      case kRadial2:
        return radial;
      case kCentreX:
      case kCentreY:
        return centre;
      case kTangential1:
      case kTangential2:
        return tangential;
      default:
        return readout;
    }
  }
};

/// The blocks of the normal equations J^T W J and J^T W r at a state, W the Huber weights (Triggs
/// et al. 2000, section 6). Block names say rows, columns.
struct BundleLinearisation {
  /// Keeps the memory of the last call. The number of threads changes nothing in the result.
  void Compute(const BundleStructure& structure, const BundleState& state, const HuberLoss& loss,
               const RefinedCalibration& refined, int threads = 1);

  std::vector<Matrix6d> camera_camera;  ///< By free camera.
  std::vector<Vector6d> camera_gradient;
  std::vector<Eigen::Matrix3d> landmark_landmark;  ///< By group.
  std::vector<Eigen::Vector3d> landmark_gradient;
  std::vector<CameraPairBlock> camera_pair;  ///< By the structure's pairs.
  std::vector<Matrix63d> camera_landmark;  ///< By grouped observation; undefined for fixed cameras.

  bool has_calibration = false;
  MatrixCalibration calibration_calibration;
  VectorCalibration calibration_gradient;
  std::vector<Matrix6Calibration> camera_calibration;    ///< By free camera.
  std::vector<MatrixCalibration3> calibration_landmark;  ///< By group.

 private:
  /// What the observations of a part of the groups put into the blocks that others share.
  struct Shared {
    std::vector<Matrix6d> camera_camera;
    std::vector<Vector6d> camera_gradient;
    std::vector<Matrix6Calibration> camera_calibration;
    MatrixCalibration calibration_calibration;
    VectorCalibration calibration_gradient;
  };
  struct At;

  void ComputePart(const At& at, const PartOf& groups, Shared* shared);
  void AddObservation(const At& at, size_t i, Shared* shared);
  void AddUp(const std::vector<Shared>& parts);
  void AddPrior(const FocalPrior& prior, double fx);
  void AddPrior(const CentrePrior& prior, const Pinhole& pinhole);
  void AddPrior(const SmallPrior& prior, const BundleCamera& camera);

  std::vector<Shared> parts_;
};

/// Sum of the Huber losses of the grouped observations, of the factors and of the priors' losses.
/// An error above 45 degrees, or a landmark behind the camera, costs as much as 45 degrees and has
/// no part in the linearisation: it is an outlier of the step.
/// The number of threads changes nothing in the result.
double BundleCost(const BundleStructure& structure, const BundleState& state, const HuberLoss& loss,
                  int threads = 1);

}  // namespace deepuav
