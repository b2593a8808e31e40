#include "deepuav/estimation/sim3_ransac.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "deepuav/base/options.h"
#include "deepuav/base/random.h"
#include "deepuav/geometry/alignment.h"

namespace deepuav {
namespace {

constexpr int kSample = 3;
/// Of the angle at a sample's first point: points nearly on a line leave the rotation to their
/// noise.
constexpr double kMinSampleSine = 0.02;

bool SpansPlane(const std::vector<Eigen::Vector3d>& triangle) {
  const Eigen::Vector3d a = triangle[1] - triangle[0], b = triangle[2] - triangle[0];
  return a.cross(b).norm() > kMinSampleSine * a.norm() * b.norm();
}

class Sim3Ransac {
 public:
  Sim3Ransac(const Pinhole& pinhole, const std::vector<Sim3Correspondence>& correspondences,
             uint64_t seed, const Sim3RansacOptions& options)
      : pinhole_(pinhole), options_(options), random_(seed), from_(kSample), to_(kSample) {
    usable_.reserve(correspondences.size());
    for (const Sim3Correspondence& c : correspondences) {
      if (UsableCorrespondence(c)) usable_.push_back(c);
    }
    inliers_.reserve(usable_.size());
  }

  /// The best similarity; nothing where no sample had one.
  std::optional<Sim3> Run(int* iterations) {
    if (usable_.size() < kSample) return std::nullopt;
    int needed = options_.max_iterations;
    for (*iterations = 0; *iterations < needed; ++*iterations) {
      const std::optional<Sim3> sample = SampleEstimate();
      if (!sample) continue;
      const Score score = Rate(*sample, best_sample_);
      if (!(score.cost < best_sample_)) continue;
      best_sample_ = score.cost;
      Refine(*sample, score);
      needed = std::min(needed, NeededIterations());
    }
    return best_;
  }

 private:
  std::optional<Sim3> SampleEstimate() {
    std::array<int, kSample> sample{};
    const int count = static_cast<int>(usable_.size());
    for (int i = 0; i < kSample; ++i) {
      const auto end = sample.begin() + i;
      do {
        sample[i] = random_.Index(count);
      } while (std::find(sample.begin(), end, sample[i]) != end);
      from_[i] = usable_[sample[i]].point_b;
      to_[i] = usable_[sample[i]].point_a;
    }
    if (!SpansPlane(from_) || !SpansPlane(to_)) return std::nullopt;
    const AlignmentKind kind =
        options_.fixed_scale ? AlignmentKind::kRigid : AlignmentKind::kSimilar;
    return Align(from_, to_, kind);
  }

  struct Score {
    double cost;  // The sum of the truncated errors.
    int inliers;
  };

  /// Stops adding where the cost reaches `bound`.
  Score Rate(const Sim3& candidate, double bound) const {
    const Sim3 b_from_a = candidate.Inverse();
    Score score{0, 0};
    for (const Sim3Correspondence& c : usable_) {
      const double error = ReprojectBothWays(pinhole_, c, candidate, b_from_a).larger();
      score.inliers += error <= options_.chi_square;
      score.cost += std::min(error, options_.chi_square);
      if (score.cost >= bound) break;
    }
    return score;
  }

  /// Takes the candidate if it is better than the best, and goes on from its inliers as long as
  /// that lowers the cost.
  void Refine(Sim3 candidate, Score score) {
    Sim3OptimisationOptions refinement;
    refinement.rounds = 1;
    refinement.iterations = options_.refinement_iterations;
    refinement.chi_square = options_.chi_square;
    refinement.fixed_scale = options_.fixed_scale;
    for (int round = 0;; ++round) {
      if (score.cost < best_cost_) {
        best_ = candidate;
        best_cost_ = score.cost;
        best_inliers_ = score.inliers;
      }
      if (round == options_.refinements) return;
      FindInliers(candidate);
      const Sim3 refined = OptimizeSim3(pinhole_, inliers_, candidate, refinement).a_from_b;
      const Score refined_score = Rate(refined, score.cost);
      if (!(refined_score.cost < score.cost)) return;
      candidate = refined;
      score = refined_score;
    }
  }

  void FindInliers(const Sim3& candidate) {
    const Sim3 b_from_a = candidate.Inverse();
    inliers_.clear();
    for (const Sim3Correspondence& c : usable_) {
      if (ReprojectBothWays(pinhole_, c, candidate, b_from_a).larger() <= options_.chi_square) {
        inliers_.push_back(c);
      }
    }
  }

  int NeededIterations() const {
    const double ratio = best_inliers_ / static_cast<double>(usable_.size());
    const double good_sample = std::pow(ratio, kSample);
    if (good_sample >= 1) return 1;
    const double needed = std::log(1 - options_.confidence) / std::log1p(-good_sample);
    return needed < options_.max_iterations ? static_cast<int>(std::ceil(needed))
                                            : options_.max_iterations;
  }

  const Pinhole& pinhole_;
  const Sim3RansacOptions& options_;
  Random random_;
  std::vector<Sim3Correspondence> usable_, inliers_;
  std::vector<Eigen::Vector3d> from_, to_;
  std::optional<Sim3> best_;
  double best_cost_ = std::numeric_limits<double>::infinity();
  double best_sample_ = std::numeric_limits<double>::infinity();  // Cost before refinement.
  int best_inliers_ = 0;
};

}  // namespace

void Sim3RansacOptions::Check() const {
  CheckOption(chi_square > 0 && std::isfinite(chi_square), "chi_square", chi_square, "above 0");
  CheckOption(confidence > 0 && confidence < 1, "confidence", confidence, "between 0 and 1");
  CheckOption(max_iterations >= 1, "max_iterations", max_iterations, "at least 1");
  CheckOption(min_inliers >= kSample, "min_inliers", min_inliers, "at least 3");
  CheckOption(refinements >= 0, "refinements", refinements, "at least 0");
  CheckOption(refinement_iterations >= 1, "refinement_iterations", refinement_iterations,
              "at least 1");
}

std::optional<Sim3Estimate> EstimateSim3(const Pinhole& pinhole,
                                         const std::vector<Sim3Correspondence>& correspondences,
                                         uint64_t seed, const Sim3RansacOptions& options) {
  options.Check();
  Sim3Estimate result;
  const std::optional<Sim3> best =
      Sim3Ransac(pinhole, correspondences, seed, options).Run(&result.iterations);
  if (!best) return std::nullopt;
  result.a_from_b = *best;
  result.inlier.resize(correspondences.size());
  const Sim3 b_from_a = best->Inverse();
  for (size_t i = 0; i < correspondences.size(); ++i) {
    const Sim3Correspondence& c = correspondences[i];
    result.inlier[i] =
        UsableCorrespondence(c) &&
        ReprojectBothWays(pinhole, c, *best, b_from_a).larger() <= options.chi_square;
    result.inlier_count += result.inlier[i];
  }
  if (result.inlier_count < options.min_inliers) return std::nullopt;
  return result;
}

}  // namespace deepuav
