#include "deepuav/estimation/bundle/reduced_camera_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "deepuav/base/parallel.h"
#include "deepuav/estimation/solvers/selected_inverse.h"
#include "deepuav/estimation/solvers/six_rows.h"

namespace deepuav {
namespace {

/// Below this a diagonal element is damped as if it were this: a parameter that nothing sees must
/// not move.
constexpr double kMinDiagonal = 1e-9;

template <typename Matrix>
Matrix Damped(const Matrix& block, double damping) {
  Matrix damped = block;
  damped.diagonal() += damping * block.diagonal().cwiseMax(kMinDiagonal);
  return damped;
}

/// d^T diag(block) d as in Damped.
template <typename Matrix, typename Vector>
double DampedNorm(const Matrix& block, const Vector& d) {
  return block.diagonal().cwiseMax(kMinDiagonal).dot(d.cwiseAbs2());
}

}  // namespace

ReducedCameraSystem::ReducedCameraSystem(const BundleStructure& structure, int sparse_cameras,
                                         int threads)
    : structure_(structure),
      sparse_(structure.free_cameras() >= sparse_cameras),
      threads_(threads) {
  FindPattern();
  if (sparse_) factor_.emplace(pattern_);
}

void ReducedCameraSystem::FindPattern() {
  const int cameras = structure_.free_cameras();
  std::vector<int>& rows = pattern_.rows;
  std::vector<int> marked_for(cameras, -1);
  size_t next_pair = 0;  // They come by column.
  for (int i = 0; i < cameras; ++i) {
    marked_for[i] = i;
    rows.push_back(i);
    for (int k = structure_.camera_begin[i]; k < structure_.camera_begin[i + 1]; ++k) {
      const int group = structure_.observations[structure_.camera_observations[k]].group;
      for (int p = structure_.camera_observations[k] + 1; p < structure_.group_begin[group + 1];
           ++p) {
        const int row = structure_.observations[p].free_camera;
        if (marked_for[row] == i) continue;
        marked_for[row] = i;
        rows.push_back(row);
      }
    }
    for (; next_pair < structure_.camera_pairs.size() &&
           structure_.camera_pairs[next_pair].column == i;
         ++next_pair) {
      const int row = structure_.camera_pairs[next_pair].row;
      if (marked_for[row] != i) rows.push_back(row);
      marked_for[row] = i;
    }
    std::sort(rows.begin() + pattern_.begin[i], rows.end());
    pattern_.begin.push_back(static_cast<int>(rows.size()));
  }

  // The values of a block column are one dense matrix of six columns, column by column.
  matrix_.resize(6 * cameras, 6 * cameras);
  matrix_.resizeNonZeros(36 * static_cast<Eigen::Index>(rows.size()));
  for (int i = 0; i < cameras; ++i) {
    const int blocks = pattern_.blocks(i);
    for (int c = 0; c < 6; ++c) {
      const int begin = 36 * pattern_.begin[i] + 6 * blocks * c;
      matrix_.outerIndexPtr()[6 * i + c] = begin;
      for (int slot = 0; slot < blocks; ++slot) {
        for (int r = 0; r < 6; ++r) {
          matrix_.innerIndexPtr()[begin + 6 * slot + r] = 6 * rows[pattern_.begin[i] + slot] + r;
        }
      }
    }
  }
  matrix_.outerIndexPtr()[6 * cameras] = 36 * static_cast<int>(rows.size());
}

bool ReducedCameraSystem::Solve(const BundleLinearisation& linearisation, double damping,
                                BundleStep* step) {
  InvertLandmarks(linearisation, damping);
  EliminateLandmarks(linearisation, damping);
  if (!SolveCameras(linearisation.has_calibration)) return false;
  step->calibration.setZero();
  if (linearisation.has_calibration && !SolveCalibration(step)) return false;
  BackSubstitute(linearisation, step);

  PredictDecrease(linearisation, damping, step);
  return std::isfinite(step->predicted_decrease);
}

void ReducedCameraSystem::PredictDecrease(const BundleLinearisation& linearisation, double damping,
                                          BundleStep* step) const {
  double decrease = 0, of_cameras = 0;
  const auto add = [&](const auto& block, const auto& gradient, const auto& d) {
    decrease += damping * DampedNorm(block, d) - gradient.dot(d);
  };
  for (size_t i = 0; i < step->camera.size(); ++i) {
    add(linearisation.camera_camera[i], linearisation.camera_gradient[i], step->camera[i]);
    of_cameras -= right_.block<6, 1>(6 * static_cast<Eigen::Index>(i), 0).dot(step->camera[i]);
  }
  for (size_t i = 0; i < step->landmark.size(); ++i) {
    add(linearisation.landmark_landmark[i], linearisation.landmark_gradient[i], step->landmark[i]);
  }
  add(linearisation.calibration_calibration, linearisation.calibration_gradient, step->calibration);
  if (linearisation.has_calibration) of_cameras -= calibration_right_.dot(step->calibration);
  step->predicted_decrease = decrease;
  step->camera_decrease = of_cameras;
}

template <typename Work>
void ReducedCameraSystem::ForGroups(const Work& work) const {
  const int parts = structure_.parts();
  ForEachInParallel(parts, threads_, [&](int part) {
    const PartOf groups(structure_.groups(), part, parts);
    work(part, groups);
  });
}

void ReducedCameraSystem::InvertLandmarks(const BundleLinearisation& linearisation,
                                          double damping) {
  landmark_inverse_.resize(structure_.groups());
  ForGroups([&](int, const PartOf& groups) {
    for (int group = groups.first; group < groups.last; ++group) {
      const Eigen::LLT<Eigen::Matrix3d> factor(
          Damped(linearisation.landmark_landmark[group], damping));
      if (factor.info() == Eigen::Success) {
        landmark_inverse_[group] = factor.solve(Eigen::Matrix3d::Identity());
      } else {
        landmark_inverse_[group].setZero();  // Stays where it is in this step.
      }
    }
  });
}

void ReducedCameraSystem::EliminateLandmarks(const BundleLinearisation& linearisation,
                                             double damping) {
  matrix_.coeffs().setZero();
  const int cameras = structure_.free_cameras();
  right_.resize(6 * cameras, Eigen::NoChange);
  // Columns get shorter to the right: more parts than threads share them better.
  constexpr int kPartsOfOne = 4;
  const int parts = structure_.parts() == 1 ? 1 : kPartsOfOne * structure_.parts();
  ForEachInParallel(parts, threads_, [&](int part) {
    std::vector<int> slot_of_row(cameras, -1);
    const PartOf columns(cameras, part, parts);
    for (int camera = columns.first; camera < columns.last; ++camera)
      EliminateFromCamera(linearisation, damping, camera, &slot_of_row);
  });
  if (linearisation.has_calibration) EliminateFromCalibration(linearisation, damping);
}

void ReducedCameraSystem::EliminateFromCamera(const BundleLinearisation& linearisation,
                                              double damping, int camera,
                                              std::vector<int>* slot_of_row) {
  const int blocks = pattern_.blocks(camera);
  for (int slot = 0; slot < blocks; ++slot)
    (*slot_of_row)[pattern_.rows[pattern_.begin[camera] + slot]] = slot;
  BlockColumn column(matrix_.valuePtr() + 36 * static_cast<size_t>(pattern_.begin[camera]),
                     6 * blocks, 6);
  column.topRows<6>() = Damped(linearisation.camera_camera[camera], damping);
  AddPairs(linearisation, camera, *slot_of_row, &column);
  Vector6d gradient = linearisation.camera_gradient[camera];
  Matrix6Calibration border = Matrix6Calibration::Zero();
  if (linearisation.has_calibration) border = linearisation.camera_calibration[camera];

  for (int k = structure_.camera_begin[camera]; k < structure_.camera_begin[camera + 1]; ++k) {
    const int observation = structure_.camera_observations[k];
    const int group = structure_.observations[observation].group;
    const Eigen::Matrix<double, 3, 6> eliminated =
        landmark_inverse_[group] * linearisation.camera_landmark[observation].transpose();
    gradient.noalias() -= eliminated.transpose() * linearisation.landmark_gradient[group];
    if (linearisation.has_calibration) {
      border.noalias() -=
          eliminated.transpose() * linearisation.calibration_landmark[group].transpose();
    }
    // A landmark seen twice by one camera has every pair of its observations in the diagonal block.
    int first = observation;
    while (first > structure_.group_begin[group] &&
           structure_.observations[first - 1].free_camera == camera)
      --first;
    for (int p = first; p < structure_.group_begin[group + 1]; ++p) {
      const int slot = (*slot_of_row)[structure_.observations[p].free_camera];
      SubtractSixBySix<3>(linearisation.camera_landmark[p].data(), 6, eliminated.data(), 1, 3,
                          column.data() + 6 * slot, 6 * blocks);
    }
  }
  right_.block<6, 1>(6 * camera, 0) = gradient;
  right_.block<6, kCalibrationParameters>(6 * camera, 1) = border;
}

void ReducedCameraSystem::AddPairs(const BundleLinearisation& linearisation, int camera,
                                   const std::vector<int>& slot_of_row, BlockColumn* column) const {
  const auto& pairs = linearisation.camera_pair;
  auto pair = std::lower_bound(
      pairs.begin(), pairs.end(), camera,
      [](const CameraPairBlock& block, int wanted) { return block.column < wanted; });
  for (; pair != pairs.end() && pair->column == camera; ++pair)
    column->middleRows<6>(6 * slot_of_row[pair->row]) += pair->block;
}

void ReducedCameraSystem::EliminateFromCalibration(const BundleLinearisation& linearisation,
                                                   double damping) {
  std::vector<std::pair<MatrixCalibration, VectorCalibration>> parts(structure_.parts());
  ForGroups([&](int part, const PartOf& groups) {
    auto& [matrix, right] = parts[part];
    matrix.setZero();
    right.setZero();
    for (int group = groups.first; group < groups.last; ++group) {
      const MatrixCalibration3& block = linearisation.calibration_landmark[group];
      const MatrixCalibration3 eliminated = block * landmark_inverse_[group];
      for (int column = 0; column < kCalibrationParameters; ++column)
        matrix.col(column) -= eliminated * block.row(column).transpose();
      right.noalias() -= eliminated * linearisation.landmark_gradient[group];
    }
  });
  calibration_matrix_ = Damped(linearisation.calibration_calibration, damping);
  calibration_right_ = linearisation.calibration_gradient;
  for (const auto& [matrix, right] : parts) {
    calibration_matrix_ += matrix;
    calibration_right_ += right;
  }
}

bool ReducedCameraSystem::SolveCameras(bool has_calibration) {
  const int columns = has_calibration ? 1 + kCalibrationParameters : 1;
  solved_.setZero(right_.rows(), 1 + kCalibrationParameters);
  if (right_.rows() == 0) return true;
  if (sparse_) {
    if (!factor_->Factorise(matrix_.valuePtr(), threads_)) return false;
    if (has_calibration) {
      solved_ = right_;
      factor_->SolveInPlace(&solved_);
    } else {
      Eigen::VectorXd gradient = right_.col(0);
      factor_->SolveInPlace(&gradient);
      solved_.col(0) = gradient;
    }
    return true;
  }
  dense_ = matrix_;
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(dense_);
  if (factor.info() != Eigen::Success) return false;
  solved_.leftCols(columns) = factor.solve(right_.leftCols(columns));
  return true;
}

std::vector<Matrix6d> ReducedCameraSystem::CameraCovariances() const {
  if (sparse_) return SelectedInverse<6>(*factor_).DiagonalBlocks();
  std::vector<Matrix6d> blocks;
  const Eigen::MatrixXd inverse =
      Eigen::MatrixXd(matrix_).selfadjointView<Eigen::Lower>().llt().solve(
          Eigen::MatrixXd::Identity(matrix_.rows(), matrix_.rows()));
  for (Eigen::Index at = 0; at < inverse.rows(); at += 6)
    blocks.push_back(inverse.block<6, 6>(at, at));
  return blocks;
}

MatrixCalibration ReducedCameraSystem::CalibrationInformation() const {
  MatrixCalibration matrix = calibration_matrix_;
  matrix.noalias() -= right_.rightCols<kCalibrationParameters>().transpose() *
                      solved_.rightCols<kCalibrationParameters>();
  return matrix;
}

bool ReducedCameraSystem::SolveCalibration(BundleStep* step) {
  const auto border = right_.rightCols<kCalibrationParameters>();
  const MatrixCalibration matrix = CalibrationInformation();
  VectorCalibration gradient = calibration_right_;
  gradient.noalias() -= border.transpose() * solved_.col(0);
  const Eigen::LLT<MatrixCalibration> factor(matrix);
  if (factor.info() != Eigen::Success) return false;
  step->calibration = factor.solve(-gradient);
  return true;
}

void ReducedCameraSystem::BackSubstitute(const BundleLinearisation& linearisation,
                                         BundleStep* step) const {
  step->camera.resize(structure_.free_cameras());
  for (int i = 0; i < structure_.free_cameras(); ++i) {
    step->camera[i] = -solved_.block<6, 1>(6 * i, 0) -
                      solved_.block<6, kCalibrationParameters>(6 * i, 1) * step->calibration;
  }
  step->landmark.resize(structure_.groups());
  ForGroups([&](int, const PartOf& groups) {
    for (int group = groups.first; group < groups.last; ++group) {
      Eigen::Vector3d right = linearisation.landmark_gradient[group];
      for (int p = structure_.group_begin[group]; p < structure_.group_begin[group + 1]; ++p) {
        const int camera = structure_.observations[p].free_camera;
        if (camera >= 0)
          right.noalias() += linearisation.camera_landmark[p].transpose() * step->camera[camera];
      }
      if (linearisation.has_calibration) {
        right.noalias() +=
            linearisation.calibration_landmark[group].transpose() * step->calibration;
      }
      step->landmark[group] = -(landmark_inverse_[group] * right);
    }
  });
}

}  // namespace deepuav
