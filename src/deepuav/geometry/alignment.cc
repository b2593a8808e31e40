#include "deepuav/geometry/alignment.h"

#include <Eigen/SVD>
#include <cmath>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

// Points whose breadth is less than 1e-5 of their length count as lying on a line.
constexpr double kOpenRotation = 1e-5 * 1e-5;
constexpr size_t kMinPoints = 3;

// The means of two point sets, and the sums of products of the deviations from them.
struct Moments {
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = Eigen::Vector3d::Zero();
  double source_spread = 0, target_spread = 0;      // sums of squared deviations
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // sum of target deviation * source deviation^T
};

Moments ComputeMoments(const std::vector<Eigen::Vector3d>& source,
                       const std::vector<Eigen::Vector3d>& target) {
  Moments moments;
  for (size_t i = 0; i < source.size(); ++i) {
    moments.source_mean += source[i];
    moments.target_mean += target[i];
  }
  moments.source_mean /= static_cast<double>(source.size());
  moments.target_mean /= static_cast<double>(target.size());
  for (size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d s = source[i] - moments.source_mean, t = target[i] - moments.target_mean;
    moments.source_spread += s.squaredNorm();
    moments.target_spread += t.squaredNorm();
    moments.cross += t * s.transpose();
  }
  return moments;
}

struct RotationAndScale {
  Eigen::Matrix3d rotation;
  double scale;
};

std::optional<RotationAndScale> AlignFully(const Moments& moments) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moments.cross,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.info() != Eigen::Success) return std::nullopt;  // points that are not finite
  Eigen::Vector3d signs(1, 1, 1);
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs.z() = -1;
  const Eigen::Vector3d values = svd.singularValues().cwiseProduct(signs);
  // The rotation is unique where the two smaller values, signed, have a positive sum (Umeyama 1991,
  // lemma).
  if (!(values.y() + values.z() > kOpenRotation * values.x())) return std::nullopt;
  return RotationAndScale{svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose(),
                          values.sum() / moments.source_spread};
}

std::optional<RotationAndScale> AlignYaw(const Moments& moments) {
  const Eigen::Matrix3d& cross = moments.cross;
  const double sine = cross(1, 0) - cross(0, 1), cosine = cross(0, 0) + cross(1, 1);
  if (!(std::hypot(sine, cosine) >
        kOpenRotation * std::sqrt(moments.source_spread * moments.target_spread))) {
    return std::nullopt;
  }
  const Eigen::AngleAxisd yaw(std::atan2(sine, cosine), Eigen::Vector3d::UnitZ());
  return RotationAndScale{yaw.toRotationMatrix(), 1};
}

}  // namespace

std::optional<Sim3> Align(const std::vector<Eigen::Vector3d>& source,
                          const std::vector<Eigen::Vector3d>& target, AlignmentKind kind) {
  if (source.size() != target.size()) {
    throw Error("alignment of {} points with {}: expected as many", source.size(), target.size());
  }
  if (source.size() < kMinPoints) return std::nullopt;
  const Moments moments = ComputeMoments(source, target);
  const auto found = kind == AlignmentKind::kYaw ? AlignYaw(moments) : AlignFully(moments);
  if (!found) return std::nullopt;
  const double scale = kind == AlignmentKind::kSimilar ? found->scale : 1;
  const Eigen::Quaterniond rotation(found->rotation);
  return Sim3(scale, rotation, moments.target_mean - scale * (rotation * moments.source_mean));
}

}  // namespace deepuav
