#include "deepuav/matching/epipolar.h"

#include "deepuav/base/options.h"
#include "deepuav/matching/best_two.h"

namespace deepuav {
void EpipolarOptions::Check() const {
  CheckOption(max_distance_px > 0, "mapping.epipolar.max_distance_px", max_distance_px, "above 0");
  CheckOption(min_similarity >= -1 && min_similarity < 1, "mapping.epipolar.min_similarity",
              min_similarity, "-1 up to 1");
  CheckOption(ratio > 0 && ratio <= 1, "mapping.epipolar.ratio", ratio, "above 0, at most 1");
  CheckOption(min_epipole_distance_px >= 0, "mapping.epipolar.min_epipole_distance_px",
              min_epipole_distance_px, "0 or more");
}

Eigen::Matrix3d FundamentalFromPose(const Pinhole& pinhole, const SE3& b_from_a) {
  const Eigen::Matrix3d inverse = pinhole.Matrix().inverse();
  return inverse.transpose() * Skew(b_from_a.translation()) * b_from_a.RotationMatrix() * inverse;
}

std::vector<Match> MatchEpipolar(const Features& a, const std::vector<int>& keypoints_a,
                                 const Features& b, const std::vector<int>& keypoints_b,
                                 const Pinhole& pinhole, const SE3& b_from_a,
                                 const EpipolarOptions& options) {
  const Eigen::Matrix3f fundamental = FundamentalFromPose(pinhole, b_from_a).cast<float>();
  const Eigen::Vector3d centre_a = b_from_a.translation();
  // Behind camera b too: points near the line through both cameras have no parallax either way.
  const bool epipole_seen = centre_a.z() != 0;
  const Eigen::Vector2f epipole =
      epipole_seen ? pinhole.Project(centre_a).cast<float>() : Eigen::Vector2f::Zero().eval();
  const auto max_distance = static_cast<float>(options.max_distance_px);
  const auto min_from_epipole = static_cast<float>(options.min_epipole_distance_px);

  std::vector<Eigen::Vector2f> pixels_b;
  std::vector<uint8_t> usable_b;
  for (int j : keypoints_b) {
    pixels_b.push_back(b.keypoints[static_cast<size_t>(j)].px);
    usable_b.push_back(!epipole_seen || (pixels_b.back() - epipole).norm() >= min_from_epipole);
  }
  std::vector<BestTwo> best_of_a(keypoints_a.size()), best_of_b(keypoints_b.size());
  for (size_t i = 0; i < keypoints_a.size(); ++i) {
    Eigen::Vector3f line =
        fundamental * a.keypoints[static_cast<size_t>(keypoints_a[i])].px.homogeneous();
    line /= line.head<2>().norm();
    for (size_t j = 0; j < keypoints_b.size(); ++j) {
      const float distance_px = std::abs(line.dot(pixels_b[j].homogeneous()));
      if (!(distance_px <= max_distance) || !usable_b[j])
        continue;  // not a number: there is no line
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
