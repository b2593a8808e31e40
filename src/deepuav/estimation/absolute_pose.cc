#include "deepuav/estimation/absolute_pose.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "deepuav/base/options.h"
#include "deepuav/estimation/reprojection.h"
#include "deepuav/estimation/usac.h"

namespace deepuav {
namespace {

constexpr size_t kMinimalObservations = 4;  // P3P and one point more to tell its solutions apart.
constexpr int kSampleSize = 3;

bool Finite(const PoseObservation& observation) {
  return observation.landmark_world.allFinite() && observation.px.allFinite();
}

/// After how many samples a pose with the least number of inliers that counts would have been
/// found: more of them could only find poses that do not count.
int UsefulIterations(size_t observations, const AbsolutePoseOptions& options) {
  const double inlier_share =
      std::min(1.0, options.min_inliers / static_cast<double>(observations));
  const double good_sample = std::pow(inlier_share, kSampleSize);
  if (good_sample == 1) return 1;
  const double needed = std::log(1 - options.confidence) / std::log1p(-good_sample);
  return std::min(options.max_iterations, static_cast<int>(std::ceil(needed)));
}

/// The pose that USAC finds, of normalised image points (depth 1) so that OpenCV needs no camera
/// matrix.
std::optional<SE3> RobustP3P(const Pinhole& pinhole,
                             const std::vector<PoseObservation>& observations, uint64_t seed,
                             const AbsolutePoseOptions& options) {
  std::vector<cv::Point3d> landmarks;
  std::vector<cv::Point2d> rays;
  landmarks.reserve(observations.size());
  rays.reserve(observations.size());
  for (const PoseObservation& observation : observations) {
    if (!Finite(observation)) continue;
    const Eigen::Vector3d& p = observation.landmark_world;
    const Eigen::Vector3d ray = pinhole.Unproject(observation.px);
    landmarks.emplace_back(p.x(), p.y(), p.z());
    rays.emplace_back(ray.x(), ray.y());
  }
  if (landmarks.size() < kMinimalObservations) return std::nullopt;

  const double threshold = options.max_error_px / std::sqrt(pinhole.fx * pinhole.fy);
  const cv::UsacParams params = MakeUsacParams(threshold, options.confidence,
                                               UsefulIterations(landmarks.size(), options), seed);
  cv::Mat camera = cv::Mat::eye(3, 3, CV_64F), rotation_vector, translation, inliers;
  try {
    if (!cv::solvePnPRansac(landmarks, rays, camera, cv::noArray(), rotation_vector, translation,
                            inliers, params)) {
      return std::nullopt;
    }
  } catch (const cv::Exception&) {
    return std::nullopt;  // OpenCV throws where a degenerate sample leaves a solver without a
                          // model.
  }
  if (rotation_vector.total() != 3 || translation.total() != 3) return std::nullopt;
  rotation_vector.convertTo(rotation_vector, CV_64F);
  translation.convertTo(translation, CV_64F);
  const Eigen::Vector3d rotation(rotation_vector.ptr<double>());
  const Eigen::Vector3d offset(translation.ptr<double>());
  if (!rotation.allFinite() || !offset.allFinite()) return std::nullopt;
  return SE3(RotationExp(rotation), offset);
}

}  // namespace

void AbsolutePoseOptions::Check() const {
  CheckOption(max_error_px > 0, "max_error_px", max_error_px, "above 0");
  CheckOption(confidence > 0 && confidence < 1, "confidence", confidence, "between 0 and 1");
  CheckOption(max_iterations >= 1, "max_iterations", max_iterations, "at least 1");
  CheckOption(min_inliers >= 4, "min_inliers", min_inliers, "at least 4");
}

std::optional<AbsolutePose> EstimateAbsolutePose(const Pinhole& pinhole,
                                                 const std::vector<PoseObservation>& observations,
                                                 uint64_t seed,
                                                 const AbsolutePoseOptions& options) {
  options.Check();
  const std::optional<SE3> pose = RobustP3P(pinhole, observations, seed, options);
  if (!pose) return std::nullopt;

  AbsolutePose result;
  result.cam_from_world = *pose;
  result.inlier.resize(observations.size());
  for (size_t i = 0; i < observations.size(); ++i) {
    const Eigen::Vector3d point = *pose * observations[i].landmark_world;
    result.inlier[i] = Finite(observations[i]) && InFrontOfCamera(point) &&
                       (pinhole.Project(point) - observations[i].px).norm() <= options.max_error_px;
    result.inlier_count += result.inlier[i];
  }
  if (result.inlier_count < options.min_inliers) return std::nullopt;
  return result;
}

}  // namespace deepuav
