#include "deepuav/matching/projection.h"

#include "deepuav/base/option_check.h"
#include "deepuav/matching/best_two.h"

namespace deepuav {
namespace {

struct Candidate {
  int target = -1;
  float similarity = -2;  // below any cosine
};

}  // namespace

void ProjectionOptions::Check() const { CheckOptions("projection", *this); }

std::vector<Match> MatchProjected(const std::vector<ProjectionTarget>& targets,
                                  const Descriptors& target_descriptors, const Features& features,
                                  const KeypointGrid& grid, const ProjectionOptions& options) {
  std::vector<Candidate> best_target(static_cast<size_t>(features.size()));
  std::vector<int> nearby;
  for (size_t t = 0; t < targets.size(); ++t) {
    grid.Find(targets[t].px, targets[t].radius_px, &nearby);
    BestTwo best;
    for (int keypoint : nearby) {
      best.Offer(keypoint, target_descriptors.Similarity(targets[t].descriptor,
                                                         features.descriptors, keypoint));
    }
    if (best.index < 0 || best.first < options.min_similarity || !best.PassesRatio(options.ratio))
      continue;
    Candidate& taken = best_target[static_cast<size_t>(best.index)];
    if (best.first > taken.similarity) taken = {static_cast<int>(t), best.first};
  }
  std::vector<Match> matches;
  for (size_t k = 0; k < best_target.size(); ++k) {
    if (best_target[k].target >= 0) {
      matches.push_back({best_target[k].target, static_cast<int>(k), best_target[k].similarity});
    }
  }
  return matches;
}

}  // namespace deepuav
