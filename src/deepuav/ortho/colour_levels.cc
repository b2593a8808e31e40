#include "deepuav/ortho/colour_levels.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr int kChannels = 3;
constexpr int kFalloffs = 2;

/// Two photographs of one node.
struct Overlap {
  int first, second;
  Eigen::Vector2d falloffs;           ///< Radii^2 and ^4 of the first less those of the second.
  Eigen::RowVector3d log_difference;  ///< Of the second's colour to the first's.
};

/// Neither nearly black nor burnt out, where gains say nothing.
bool IsTelling(const cv::Vec3b& colour) {
  constexpr int kDark = 12, kBright = 245;
  for (int channel = 0; channel < kChannels; ++channel) {
    if (colour[channel] < kDark || colour[channel] > kBright) return false;
  }
  return true;
}

Eigen::RowVector3d Logarithm(const cv::Vec3b& colour) {
  return {std::log(colour[0]), std::log(colour[1]), std::log(colour[2])};
}

std::vector<Overlap> Overlaps(const ViewChoice& choice, const NodeColours& colours) {
  constexpr size_t kMost = 400000;
  const size_t stride = std::max<size_t>(1, colours.size() * (kMaxCandidates - 1) / kMost);
  std::vector<Overlap> overlaps;
  for (size_t node = 0; node < colours.size(); node += stride) {
    const Candidates& candidates = choice.of_node[node];
    for (size_t slot = 1; slot < kMaxCandidates && candidates[slot].view >= 0; ++slot) {
      const Candidate &first = candidates[slot - 1], &second = candidates[slot];
      const cv::Vec3b &a = colours[node][slot - 1], &b = colours[node][slot];
      if (!IsTelling(a) || !IsTelling(b)) continue;
      const double r2 = static_cast<double>(first.radius2),
                   s2 = static_cast<double>(second.radius2);
      overlaps.push_back(
          {first.view, second.view, {r2 - s2, r2 * r2 - s2 * s2}, Logarithm(b) - Logarithm(a)});
    }
  }
  return overlaps;
}

/// Rows: a logarithm of gain a view, then the falloffs; columns: channels.
using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, kChannels>;

Eigen::RowVector3d Residual(const Overlap& overlap, const Unknowns& unknowns) {
  return unknowns.row(overlap.first) - unknowns.row(overlap.second) +
         overlap.falloffs.transpose() * unknowns.bottomRows<kFalloffs>() - overlap.log_difference;
}

Unknowns Solve(size_t views, const std::vector<Overlap>& overlaps, const Unknowns& before) {
  // Of the colours of one place in two photographs, and of gains and falloffs about none.
  constexpr double kSigma = 0.1, kGainSigma = 0.5, kFalloffSigma = 0.5;
  const auto count = static_cast<Eigen::Index>(views) + kFalloffs;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Unknowns right = Unknowns::Zero(count, kChannels);
  const auto square = [](double value) { return value * value; };
  normal.diagonal().setConstant(square(kSigma / kGainSigma));
  normal.diagonal().tail<kFalloffs>().setConstant(square(kSigma / kFalloffSigma));
  for (const Overlap& overlap : overlaps) {
    // Cauchy's weight, of the channels together.
    const double weight =
        1 / (1 + Residual(overlap, before).squaredNorm() / (kChannels * square(kSigma)));
    const Eigen::Index at[] = {overlap.first, overlap.second, count - 2, count - 1};
    const double slope[] = {1, -1, overlap.falloffs.x(), overlap.falloffs.y()};
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) normal(at[i], at[j]) += weight * slope[i] * slope[j];
      right.row(at[i]) += weight * slope[i] * overlap.log_difference;
    }
  }
  return normal.ldlt().solve(right);
}

cv::Vec3d ToVec(const Eigen::RowVector3d& row) { return {row[0], row[1], row[2]}; }

}  // namespace

cv::Vec3d ColourLevels::Factor(int view, double radius2) const {
  const cv::Vec3d log =
      log_gains[static_cast<size_t>(view)] + falloff2 * radius2 + falloff4 * (radius2 * radius2);
  return {std::exp(log[0]), std::exp(log[1]), std::exp(log[2])};
}

ColourLevels LevelColours(size_t views, const ViewChoice& choice, const NodeColours& colours) {
  constexpr int kRounds = 5;
  const std::vector<Overlap> overlaps = Overlaps(choice, colours);
  Unknowns unknowns = Unknowns::Zero(static_cast<Eigen::Index>(views) + kFalloffs, kChannels);
  for (int round = 0; round < kRounds; ++round) unknowns = Solve(views, overlaps, unknowns);
  ColourLevels levels;
  for (size_t view = 0; view < views; ++view)
    levels.log_gains.push_back(ToVec(unknowns.row(static_cast<Eigen::Index>(view))));
  levels.falloff2 = ToVec(unknowns.row(unknowns.rows() - 2));
  levels.falloff4 = ToVec(unknowns.row(unknowns.rows() - 1));
  return levels;
}

}  // namespace deepuav
