#include "deepuav/estimation/poses/bearing_rotation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr int kFitRounds = 3;  // each may bring in a few more pairs

struct Bearings {
  Eigen::Matrix3Xd a, b;  ///< Of unit length.
};

Bearings BearingsOf(const Pinhole& pinhole, const std::vector<PixelPair>& pairs) {
  Bearings bearings;
  const auto count = static_cast<Eigen::Index>(pairs.size());
  bearings.a.resize(3, count);
  bearings.b.resize(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const PixelPair& pair = pairs[static_cast<size_t>(i)];
    bearings.a.col(i) = pinhole.Unproject(pair.a_px).normalized();
    bearings.b.col(i) = pinhole.Unproject(pair.b_px).normalized();
  }
  return bearings;
}

/// From sum b a^T, which is of rank two where there are but two pairs.
Eigen::Matrix3d RotationOf(const Eigen::Matrix3d& correlation) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, svd.matrixU().determinant() * svd.matrixV().determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

/// Returns how many pairs lie within the chord.
int Classify(const Bearings& bearings, const Eigen::Matrix3d& b_from_a, double max_chord,
             std::vector<uint8_t>* inlier) {
  const Eigen::RowVectorXd squared = (b_from_a * bearings.a - bearings.b).colwise().squaredNorm();
  int count = 0;
  for (Eigen::Index i = 0; i < squared.size(); ++i) {
    const bool agrees = squared[i] <= max_chord * max_chord;
    (*inlier)[static_cast<size_t>(i)] = agrees;
    count += agrees;
  }
  return count;
}

Eigen::Matrix3d FitTo(const Bearings& bearings, const std::vector<uint8_t>& inlier) {
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < bearings.a.cols(); ++i) {
    if (inlier[static_cast<size_t>(i)])
      correlation += bearings.b.col(i) * bearings.a.col(i).transpose();
  }
  return RotationOf(correlation);
}

}  // namespace

std::optional<BearingRotation> EstimateBearingRotation(const Pinhole& pinhole,
                                                       const std::vector<PixelPair>& pairs,
                                                       double tolerance_px, int iterations,
                                                       uint64_t seed) {
  if (pairs.size() < 2) return std::nullopt;
  const Bearings bearings = BearingsOf(pinhole, pairs);
  const double max_chord = tolerance_px / std::sqrt(pinhole.fx * pinhole.fy);
  Random random(seed);
  BearingRotation best{Eigen::Quaterniond::Identity(), std::vector<uint8_t>(pairs.size(), 0), 0};
  std::vector<uint8_t> inlier(pairs.size());
  const auto keep_if_supported = [&](const Eigen::Matrix3d& rotation, int min_count) {
    const int agreeing = Classify(bearings, rotation, max_chord, &inlier);
    if (agreeing < min_count) return false;
    best = {Eigen::Quaterniond(rotation), inlier, agreeing};
    return true;
  };
  const int count = static_cast<int>(pairs.size());
  for (int i = 0; i < iterations; ++i) {
    const int first = random.Index(count), second = random.Index(count);
    if (first == second) continue;
    const Eigen::Matrix3d correlation = bearings.b.col(first) * bearings.a.col(first).transpose() +
                                        bearings.b.col(second) * bearings.a.col(second).transpose();
    keep_if_supported(RotationOf(correlation), best.inlier_count + 1);
  }
  if (best.inlier_count < 2) return std::nullopt;
  for (int round = 0; round < kFitRounds; ++round) {
    if (!keep_if_supported(FitTo(bearings, best.inlier), best.inlier_count)) break;
  }
  return best;
}

}  // namespace deepuav
