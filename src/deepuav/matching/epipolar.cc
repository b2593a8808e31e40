#include "deepuav/matching/epipolar.h"

#include "deepuav/base/option_check.h"
#include "deepuav/matching/best_two.h"

namespace deepuav {
namespace {

/// Where view b may show the points of view a.
class EpipolarGeometry {
 public:
  EpipolarGeometry(const Pinhole& pinhole, const SE3& b_from_a, const EpipolarOptions& options)
      : fundamental_(FundamentalFromPose(pinhole, b_from_a).cast<float>()),
        max_distance_(static_cast<float>(options.max_distance_px)),
        min_from_epipole_(static_cast<float>(options.min_epipole_distance_px)) {
    const Eigen::Vector3d centre_a = b_from_a.translation();
    // Behind camera b too: points near the line through both cameras have no parallax either way.
    epipole_seen_ = centre_a.z() != 0;
    if (epipole_seen_) epipole_ = pinhole.Project(centre_a).cast<float>();
  }

  /// Normalised so that its product with a pixel of b is the pixel's distance.
  Eigen::Vector3f LineInB(const Eigen::Vector2f& px_a) const {
    const Eigen::Vector3f line = fundamental_ * px_a.homogeneous();
    return line / line.head<2>().norm();
  }

  bool IsNear(const Eigen::Vector3f& line, const Eigen::Vector2f& px_b) const {
    return std::abs(line.dot(px_b.homogeneous())) <= max_distance_;  // false without a line: NaN
  }

  bool HasParallax(const Eigen::Vector2f& px_b) const {
    return !epipole_seen_ || (px_b - epipole_).norm() >= min_from_epipole_;
  }

 private:
  Eigen::Matrix3f fundamental_;
  Eigen::Vector2f epipole_ = Eigen::Vector2f::Zero();
  float max_distance_, min_from_epipole_;  ///< px
  bool epipole_seen_ = false;
};

}  // namespace

void EpipolarOptions::Check() const { CheckOptions("mapping.epipolar", *this); }

Eigen::Matrix3d FundamentalFromPose(const Pinhole& pinhole, const SE3& b_from_a) {
  const Eigen::Matrix3d inverse = pinhole.Matrix().inverse();
  return inverse.transpose() * Skew(b_from_a.translation()) * b_from_a.RotationMatrix() * inverse;
}

std::vector<Match> KeepEpipolar(const std::vector<Match>& matches, const Features& a,
                                const Features& b, const Pinhole& pinhole, const SE3& b_from_a,
                                const EpipolarOptions& options) {
  const EpipolarGeometry geometry(pinhole, b_from_a, options);
  std::vector<Match> kept;
  for (const Match& match : matches) {
    const Eigen::Vector2f& px_b = b.keypoints[static_cast<size_t>(match.b)].px;
    const Eigen::Vector3f line = geometry.LineInB(a.keypoints[static_cast<size_t>(match.a)].px);
    if (geometry.HasParallax(px_b) && geometry.IsNear(line, px_b)) kept.push_back(match);
  }
  return kept;
}

std::vector<Match> MatchEpipolar(const Features& a, const std::vector<int>& keypoints_a,
                                 const Features& b, const std::vector<int>& keypoints_b,
                                 const Pinhole& pinhole, const SE3& b_from_a,
                                 const EpipolarOptions& options) {
  const EpipolarGeometry geometry(pinhole, b_from_a, options);
  std::vector<Eigen::Vector2f> pixels_b;
  std::vector<uint8_t> usable_b;
  for (int j : keypoints_b) {
    pixels_b.push_back(b.keypoints[static_cast<size_t>(j)].px);
    usable_b.push_back(geometry.HasParallax(pixels_b.back()));
  }
  std::vector<BestTwo> best_of_a(keypoints_a.size()), best_of_b(keypoints_b.size());
  for (size_t i = 0; i < keypoints_a.size(); ++i) {
    const Eigen::Vector3f line =
        geometry.LineInB(a.keypoints[static_cast<size_t>(keypoints_a[i])].px);
    for (size_t j = 0; j < keypoints_b.size(); ++j) {
      if (!usable_b[j] || !geometry.IsNear(line, pixels_b[j])) continue;
      const float similarity =
          a.descriptors.Similarity(keypoints_a[i], b.descriptors, keypoints_b[j]);
      best_of_a[i].Offer(static_cast<int>(j), similarity);
      best_of_b[j].Offer(static_cast<int>(i), similarity);
    }
  }
  std::vector<Match> matches;
  for (size_t i = 0; i < keypoints_a.size(); ++i) {
    const BestTwo& best = best_of_a[i];
    if (best.index < 0 || best.first < options.min_similarity) continue;
    if (best_of_b[static_cast<size_t>(best.index)].index != static_cast<int>(i)) continue;
    if (!best.PassesRatio(options.ratio)) continue;
    matches.push_back({keypoints_a[i], keypoints_b[static_cast<size_t>(best.index)], best.first});
  }
  return matches;
}

}  // namespace deepuav
