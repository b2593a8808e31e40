#pragma once

#include "deepuav/base/option_bounds.h"
#include "deepuav/matching/matcher.h"

namespace deepuav {

struct NearestNeighbourOptions {
  double min_similarity = 0.7;  ///< Cosine.
  double ratio = 0.95;  ///< Distance to the best over distance to the second best; 1 accepts all.
  double max_motion_px = 0;  ///< Largest displacement between the images; 0: any.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("min_similarity", min_similarity, "", "least cosine similarity of a match", Below(-1, 1));
    visit("ratio", ratio, "", "distance to the best over distance to the second best, at most",
          Above(0, 1));
    visit("max_motion_px", max_motion_px, "px", "largest displacement between the images; 0: any",
          Between(0, 100'000));
  }
};

/// Mutual nearest neighbours in descriptor space, gated by similarity, ratio (Lowe 2004) and
/// displacement.
class NearestNeighbourMatcher : public Matcher {
 public:
  explicit NearestNeighbourMatcher(const NearestNeighbourOptions& options);

  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override;
  std::string Description() const override;

 private:
  /// Makes pairs of key points that lie too far apart unlike.
  void ExcludeFarMotions(const Features& a, const Features& b);

  const NearestNeighbourOptions options_;
  std::vector<float> similarity_;  ///< Kept between calls to save the allocation.
};

}  // namespace deepuav
