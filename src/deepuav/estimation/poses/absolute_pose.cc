#include "deepuav/estimation/poses/absolute_pose.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deepuav/base/option_check.h"
#include "deepuav/base/random.h"
#include "deepuav/estimation/poses/p3p.h"
#include "deepuav/estimation/poses/reprojection.h"

namespace deepuav {
namespace {

constexpr int kMinimalObservations = 4;  // P3P and one point more to tell its solutions apart.
constexpr int kSampleSize = 3;
constexpr int kLocalOptimisations = 5;
constexpr MotionOnlyOptions kLocalOptimisation{.rounds = 1, .iterations = 3};

bool Finite(const PoseObservation& observation) {
  return observation.landmark_world.allFinite() && observation.px.allFinite();
}

/// After how many samples a good one, of inliers alone, has come with the options' confidence.
int NeededSamples(double inlier_share, const AbsolutePoseOptions& options) {
  const double good_sample = std::pow(std::min(inlier_share, 1.0), kSampleSize);
  if (good_sample == 1) return 1;
  const double needed = std::log(1 - options.confidence) / std::log1p(-good_sample);
  return static_cast<int>(std::min<double>(options.max_iterations, std::ceil(needed)));
}

/// RANSAC with MSAC's cost (Torr and Zisserman 2000), each better pose optimised on its inliers
/// (Chum et al. 2003).
class RobustP3P {
 public:
  RobustP3P(const Pinhole& pinhole, const std::vector<PoseObservation>& observations,
            const AbsolutePoseOptions& options)
      : pinhole_(pinhole), options_(options), bound_(options.max_error_px * options.max_error_px) {
    for (const PoseObservation& observation : observations) {
      if (!Finite(observation)) continue;
      observations_.push_back({observation.landmark_world, observation.px, 1});
      rays_.push_back(pinhole.Unproject(observation.px).normalized());
    }
  }

  /// Nothing where no sample gave a pose.
  std::optional<SE3> Search(uint64_t seed) {
    if (Count() < kMinimalObservations) return std::nullopt;
    Random random(seed);
    // More samples than it takes to find a pose with the least number of inliers that counts could
    // only find poses that do not.
    int samples = NeededSamples(static_cast<double>(options_.min_inliers) / Count(), options_);
    for (int i = 0; i < samples; ++i) {
      if (!TrySample(&random)) continue;
      const size_t inliers = Inliers(best_).size();
      samples = std::min(samples, NeededSamples(static_cast<double>(inliers) / Count(), options_));
    }
    if (best_cost_ == std::numeric_limits<double>::infinity()) return std::nullopt;
    return best_;
  }

 private:
  int Count() const { return static_cast<int>(observations_.size()); }

  /// Whether a sample's pose, or what optimising made of it, is the best so far.
  bool TrySample(Random* random) {
    int chosen[kSampleSize];
    for (int k = 0; k < kSampleSize; ++k) {
      do {
        chosen[k] = random->Index(Count());
      } while (std::find(chosen, chosen + k, chosen[k]) != chosen + k);
    }
    std::array<Eigen::Vector3d, kSampleSize> points_world, rays_cam;
    for (size_t k = 0; k < kSampleSize; ++k) {
      points_world[k] = observations_[static_cast<size_t>(chosen[k])].landmark_world;
      rays_cam[k] = rays_[static_cast<size_t>(chosen[k])];
    }
    const P3PSolutions solutions = SolveP3P(points_world, rays_cam);
    bool better = false;
    for (int i = 0; i < solutions.count; ++i)
      better |= TakeIfBetter(solutions.cams_from_world[static_cast<size_t>(i)]);
    if (better) OptimiseBest();
    return better;
  }

  bool TakeIfBetter(const SE3& pose) {
    const double cost = CostBelow(pose, best_cost_);
    if (!(cost < best_cost_)) return false;
    best_ = pose;
    best_cost_ = cost;
    return true;
  }

  /// On the inliers, which become more with a better pose.
  void OptimiseBest() {
    MotionOnlyOptions optimisation = kLocalOptimisation;
    optimisation.chi_square = bound_;
    for (int i = 0; i < kLocalOptimisations; ++i) {
      const std::vector<PoseObservation> inliers = Inliers(best_);
      if (static_cast<int>(inliers.size()) < kMinimalObservations) return;
      const SE3 pose = OptimisePose(pinhole_, inliers, best_, optimisation).cam_from_world;
      if (!TakeIfBetter(pose)) return;
    }
  }

  double SquaredError(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
                      const PoseObservation& observation) const {
    const Eigen::Vector3d point = rotation * observation.landmark_world + translation;
    if (!InFrontOfCamera(point)) return std::numeric_limits<double>::infinity();
    return (pinhole_.Project(point) - observation.px).squaredNorm();
  }

  /// The pose's cost, or something not below `limit` as soon as it is not.
  double CostBelow(const SE3& pose, double limit) const {
    const Eigen::Matrix3d rotation = pose.RotationMatrix();
    double cost = 0;
    for (const PoseObservation& observation : observations_) {
      cost += std::min(SquaredError(rotation, pose.translation(), observation), bound_);
      if (cost >= limit) break;
    }
    return cost;
  }

  std::vector<PoseObservation> Inliers(const SE3& pose) const {
    const Eigen::Matrix3d rotation = pose.RotationMatrix();
    std::vector<PoseObservation> inliers;
    for (const PoseObservation& observation : observations_) {
      if (SquaredError(rotation, pose.translation(), observation) <= bound_)
        inliers.push_back(observation);
    }
    return inliers;
  }

  const Pinhole& pinhole_;
  const AbsolutePoseOptions& options_;
  const double bound_;  ///< Squared pixels.
  std::vector<PoseObservation> observations_;
  std::vector<Eigen::Vector3d> rays_;  ///< Unit length.
  SE3 best_;
  double best_cost_ = std::numeric_limits<double>::infinity();
};

}  // namespace

void AbsolutePoseOptions::Check() const { CheckOptions("", *this); }

std::optional<AbsolutePose> EstimateAbsolutePose(const Pinhole& pinhole,
                                                 const std::vector<PoseObservation>& observations,
                                                 uint64_t seed,
                                                 const AbsolutePoseOptions& options) {
  options.Check();
  const std::optional<SE3> pose = RobustP3P(pinhole, observations, options).Search(seed);
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
