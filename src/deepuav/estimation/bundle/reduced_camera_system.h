#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <optional>
#include <vector>

#include "deepuav/estimation/bundle/bundle_linearisation.h"
#include "deepuav/estimation/solvers/block_cholesky.h"

namespace deepuav {

/// A step of all that moves.
struct BundleStep {
  std::vector<Vector6d> camera;           ///< Twists, by free camera.
  std::vector<Eigen::Vector3d> landmark;  ///< By group.
  VectorCalibration calibration = VectorCalibration::Zero();
  /// By how much the quadratic model of the cost falls.
  double predicted_decrease = 0;
  /// The part of it for which cameras and calibration must move, landmarks following.
  double camera_decrease = 0;
};

/// The Levenberg-Marquardt step of a linearised bundle problem: the landmarks are eliminated (Schur
/// complement, Triggs et al. 2000, section 6.1), the cameras solved for by Cholesky, dense where
/// they are few, else sparse, and the calibration by block elimination after them.
class ReducedCameraSystem {
 public:
  /// From so many free cameras on the sparse factorisation is the faster one.
  static constexpr int kSparseCameras = 100;

  /// The number of threads changes nothing in the result.
  explicit ReducedCameraSystem(const BundleStructure& structure,
                               int sparse_cameras = kSparseCameras, int threads = 1);

  /// Solves (H + damping diag(H)) step = -gradient. False where the damped system is not positive
  /// definite.
  bool Solve(const BundleLinearisation& linearisation, double damping, BundleStep* step);

  /// The information of the calibration, poses and landmarks eliminated, as of the last Solve.
  MatrixCalibration CalibrationInformation() const;

  /// The covariance of each free camera's twist, as of the last Solve: of all the others,
  /// landmarks and what holds still as the problem has it; the calibration is taken as known.
  std::vector<Matrix6d> CameraCovariances() const;

  /// The lower triangle of the reduced system of the cameras, as of the last Solve.
  const Eigen::SparseMatrix<double>& matrix() const { return matrix_; }

 private:
  using BlockColumn = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6>>;
  using Border = Eigen::Matrix<double, Eigen::Dynamic, 1 + kCalibrationParameters>;

  void FindPattern();
  void InvertLandmarks(const BundleLinearisation& linearisation, double damping);
  void EliminateLandmarks(const BundleLinearisation& linearisation, double damping);
  void EliminateFromCamera(const BundleLinearisation& linearisation, double damping, int camera,
                           std::vector<int>* slot_of_row);
  /// What two cameras' factors put into the block column of the first.
  void AddPairs(const BundleLinearisation& linearisation, int camera,
                const std::vector<int>& slot_of_row, BlockColumn* column) const;
  void EliminateFromCalibration(const BundleLinearisation& linearisation, double damping);
  bool SolveCameras(bool has_calibration);
  bool SolveCalibration(BundleStep* step);
  void BackSubstitute(const BundleLinearisation& linearisation, BundleStep* step) const;
  void PredictDecrease(const BundleLinearisation& linearisation, double damping,
                       BundleStep* step) const;
  /// Runs work(part, groups) for parts of the groups.
  template <typename Work>
  void ForGroups(const Work& work) const;

  const BundleStructure& structure_;
  const bool sparse_;
  const int threads_;
  BlockPattern pattern_;
  Eigen::SparseMatrix<double> matrix_;  ///< Its values are as BlockPattern says.
  Eigen::MatrixXd dense_;
  std::optional<BlockCholesky<6>> factor_;  ///< Where sparse_.

  std::vector<Eigen::Matrix3d> landmark_inverse_;  ///< Of the damped blocks.
  Border right_;   ///< Gradient of the cameras, then their block with the calibration.
  Border solved_;  ///< The reduced system's inverse times right_.
  MatrixCalibration calibration_matrix_;
  VectorCalibration calibration_right_;
};

}  // namespace deepuav
