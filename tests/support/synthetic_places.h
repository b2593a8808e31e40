#pragma once

#include <vector>

#include "deepuav/place/vocabulary_training.h"
#include "support/synthetic_features.h"

namespace deepuav {

/// A small vocabulary.
inline Vocabulary VocabularyOf(const std::vector<Descriptors>& images) {
  VocabularyOptions options;
  options.depth = 3;
  options.split_descriptors = 20;
  return TrainVocabulary(images, options);
}
inline Vocabulary VocabularyOf(const std::vector<SyntheticView>& views) {
  std::vector<Descriptors> images;
  for (const SyntheticView& view : views) images.push_back(view.features->descriptors);
  return VocabularyOf(images);
}

/// Descriptors on the image turned by 90, 180 and 270 degrees: those of `features` at
/// `upright_turns` quarter turns, random ones at the others.
inline std::vector<Descriptors> TurnedOf(const Features& features, int upright_turns,
                                         Random* random) {
  std::vector<Descriptors> turned;
  for (int turns = 1; turns < 4; ++turns) {
    turned.push_back(turns == upright_turns
                         ? features.descriptors
                         : RandomFeatures(features.size(), 10, 10, FeatureWorld::kDimension, random)
                               .descriptors);
  }
  return turned;
}

/// The same key points with other descriptors.
inline SyntheticView Redescribed(const SyntheticView& view, Random* random) {
  SyntheticView other = view;
  other.features = std::make_shared<const Features>(Features{
      view.features->keypoints,
      RandomFeatures(view.features->size(), 10, 10, FeatureWorld::kDimension, random).descriptors});
  return other;
}

}  // namespace deepuav
