#include "deepuav/matching/nearest_neighbour.h"

#include "deepuav/base/option_check.h"
#include "deepuav/matching/best_two_scan.h"

namespace deepuav {
void NearestNeighbourOptions::Check() const { CheckOptions("matching", *this); }

NearestNeighbourMatcher::NearestNeighbourMatcher(const NearestNeighbourOptions& options)
    : options_(options) {
  options_.Check();
}

std::vector<Match> NearestNeighbourMatcher::MatchFeatures(const Features& a, const Features& b) {
  const auto rows = static_cast<size_t>(a.size()), columns = static_cast<size_t>(b.size());
  similarity_.resize(rows * columns);
  a.descriptors.SimilarityMatrix(b.descriptors, similarity_);

  if (options_.max_motion_px > 0) ExcludeFarMotions(a, b);
  const BestTwoOfMatrix best_two = FindBestTwo(similarity_, rows, columns);
  std::vector<Match> matches;
  for (size_t i = 0; i < rows; ++i) {
    const BestTwo& best = best_two.of_rows[i];
    if (best.index < 0 || best.first < options_.min_similarity) continue;
    const BestTwo& back = best_two.of_columns[static_cast<size_t>(best.index)];
    if (back.index != static_cast<int>(i)) continue;
    if (!best.PassesRatio(options_.ratio) || !back.PassesRatio(options_.ratio)) continue;
    matches.push_back({static_cast<int>(i), best.index, best.first});
  }
  return matches;
}

void NearestNeighbourMatcher::ExcludeFarMotions(const Features& a, const Features& b) {
  const double max_squared = options_.max_motion_px * options_.max_motion_px;
  float* similarity = similarity_.data();
  for (const Keypoint& from : a.keypoints) {
    for (const Keypoint& to : b.keypoints) {
      if ((from.px - to.px).squaredNorm() > max_squared) *similarity = BestTwo().first;
      ++similarity;
    }
  }
}

std::string NearestNeighbourMatcher::Description() const { return "mutual nearest neighbour"; }

}  // namespace deepuav
