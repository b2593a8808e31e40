#include "deepuav/patches/local_warp.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>

namespace deepuav {
namespace {

/// b = translation + matrix (a - centre).
struct Affinity {
  Eigen::Vector2d centre, translation;
  Eigen::Matrix2d matrix;

  double ErrorPx(const PointPair& pair) const {
    return (translation + matrix * (pair.a_px - centre) - pair.b_px).norm();
  }
};

/// The nearest in the first image, the pair itself among them.
std::vector<int> NearestPairs(const std::vector<PointPair>& pairs, size_t of, size_t count) {
  std::vector<std::pair<double, int>> by_distance;
  by_distance.reserve(pairs.size());
  for (size_t i = 0; i < pairs.size(); ++i)
    by_distance.emplace_back((pairs[i].a_px - pairs[of].a_px).squaredNorm(), static_cast<int>(i));
  count = std::min(count, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(count),
                    by_distance.end());
  std::vector<int> nearest;
  for (size_t i = 0; i < count; ++i) nearest.push_back(by_distance[i].second);
  return nearest;
}

/// Least squares with weights that fall with the error under the affinity before.
std::optional<Affinity> Fit(const std::vector<PointPair>& pairs, const std::vector<int>& indices,
                            const Eigen::Vector2d& centre, const std::optional<Affinity>& before,
                            double scale_px) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  for (int i : indices) {
    const PointPair& pair = pairs[static_cast<size_t>(i)];
    const double error = before ? before->ErrorPx(pair) / scale_px : 0;
    const double weight = 1 / (1 + error * error);
    const Eigen::Vector3d row(1, pair.a_px.x() - centre.x(), pair.a_px.y() - centre.y());
    normal += weight * row * row.transpose();
    right += weight * row * pair.b_px.transpose();
  }
  const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 1)) return std::nullopt;
  const Eigen::Matrix<double, 3, 2> solved = factor.solve(right);
  if (!solved.allFinite()) return std::nullopt;
  return Affinity{centre, solved.row(0).transpose(), solved.bottomRows<2>().transpose()};
}

/// Neither a mirror nor squeezed beyond what another view shows.
bool IsView(const Eigen::Matrix2d& warp, double max_stretch) {
  if (!(warp.determinant() > 0)) return false;
  const Eigen::Vector2d values = Eigen::JacobiSVD<Eigen::Matrix2d>(warp).singularValues();
  return values[0] <= max_stretch * values[1];
}

}  // namespace

std::vector<std::optional<Eigen::Matrix2d>> LocalWarps(const std::vector<PointPair>& pairs,
                                                       const LocalWarpOptions& options) {
  std::vector<std::optional<Eigen::Matrix2d>> warps(pairs.size());
  for (size_t i = 0; i < pairs.size(); ++i) {
    const std::vector<int> around = NearestPairs(pairs, i, static_cast<size_t>(options.neighbours));
    // Wrong pairs lose their weight little by little: at once, the first fit would keep them.
    std::optional<Affinity> fitted;
    double scale_px = options.first_scale_px;
    for (int round = 0; round < options.rounds; ++round) {
      fitted = Fit(pairs, around, pairs[i].a_px, fitted, scale_px);
      if (!fitted) break;
      scale_px = std::max(scale_px / 2, options.max_error_px / 2);
    }
    if (!fitted || fitted->ErrorPx(pairs[i]) > options.max_error_px) continue;
    const auto agreeing = std::count_if(around.begin(), around.end(), [&](int k) {
      return fitted->ErrorPx(pairs[static_cast<size_t>(k)]) <= options.max_error_px;
    });
    if (agreeing >= options.min_agreeing && IsView(fitted->matrix, options.max_stretch))
      warps[i] = fitted->matrix;
  }
  return warps;
}

}  // namespace deepuav
