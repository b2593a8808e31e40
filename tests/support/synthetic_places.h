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

/// The same key points with other descriptors.
inline SyntheticView Redescribed(const SyntheticView& view, Random* random) {
  SyntheticView other = view;
  other.features = std::make_shared<const Features>(Features{
      view.features->keypoints,
      RandomFeatures(view.features->size(), 10, 10, FeatureWorld::kDimension, random).descriptors});
  return other;
}

}  // namespace deepuav
