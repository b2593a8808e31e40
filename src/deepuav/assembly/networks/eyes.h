#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/assembly/networks/any_size_extractor.h"
#include "deepuav/assembly/settings/run_options.h"
#include "deepuav/features/superpoint_turned.h"
#include "deepuav/matching/late_matcher.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {

/// The networks and the vocabulary that a run sees with.
class Eyes {
 public:
  /// Throws Error for files that are missing, not as shipped, or do not fit one another.
  Eyes(const Camera& camera, const RunOptions& options);

  /// A survey's matcher of what the quick one leaves outside of its map, where `matching.method`
  /// left the choice. Throws Error where it is not as shipped.
  void ProvideLearnedMatcher(const Camera& camera, const RunOptions& options);

  Perception perception();
  const SuperPoint& extractor() const { return extractor_; }
  const Matcher& matcher() const { return *matcher_; }
  const std::vector<UsedModel>& models() const { return models_; }
  /// Names the vocabulary for summaries; empty where there is none.
  std::string VocabularyDescription() const;

 private:
  std::vector<UsedModel> models_;
  SuperPoint extractor_;
  std::unique_ptr<Matcher> matcher_;
  bool matcher_is_learned_;
  std::optional<NearestNeighbourMatcher> quick_matcher_;  ///< Of places, beside a slow matcher.
  std::optional<LateMatcher> learned_matcher_;
  std::string vocabulary_file_;
  std::optional<Vocabulary> vocabulary_;
  std::optional<SuperPointTurned> turned_;
  AnySizeExtractor any_size_;
};

}  // namespace deepuav
