#include "deepuav/assembly/networks/eyes.h"

#include <algorithm>
#include <filesystem>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

/// Of the pixels of an image: what is looked at reduced is reduced beyond that.
double SeenShare(const Camera& camera, const SuperPointOptions& options) {
  const double pixels = static_cast<double>(camera.width) * camera.height;
  return options.network_pixels > 0 ? std::min(1.0, options.network_pixels / pixels) : 1.0;
}

}  // namespace

Eyes::Eyes(const Camera& camera, const RunOptions& options)
    : models_(CheckModels(options)),
      extractor_(camera, options.features, options.inference),
      matcher_(MakeMatcher(options, camera)),
      matcher_is_learned_(NeedsSuperGlue(options)),
      vocabulary_file_(options.places.vocabulary),
      any_size_(options.features, options.inference, SeenShare(camera, options.features)) {
  if (!RecognisesPlaces(options)) return;
  if (NeedsSuperGlue(options)) quick_matcher_.emplace(options.matching);
  vocabulary_.emplace(Vocabulary::Load(vocabulary_file_));
  if (vocabulary_->dimension() != extractor_.dimension()) {
    throw Error("{}: is for descriptors of dimension {}: expected {} as {} gives", vocabulary_file_,
                vocabulary_->dimension(), extractor_.dimension(), options.features.model);
  }
  if (options.places.headings) {
    const SeenSize size(camera.width, camera.height, options.features.network_pixels);
    turned_.emplace(size, options.features.model, options.inference);
  }
}

void Eyes::ProvideLearnedMatcher(const Camera& camera, const RunOptions& options) {
  if (!options.matcher.may_ask_superglue || matcher_is_learned_) return;
  models_.push_back({"matcher of what is left", ShippedModels().Check(options.superglue.model)});
  learned_matcher_.emplace([camera, options] {
    return std::make_unique<SuperGlueMatcher>(camera.width, camera.height, options.superglue,
                                              options.inference);
  });
}

Perception Eyes::perception() {
  return {&extractor_,
          matcher_.get(),
          vocabulary_ ? &*vocabulary_ : nullptr,
          turned_ ? &*turned_ : nullptr,
          quick_matcher_ ? &*quick_matcher_ : nullptr,
          matcher_is_learned_,
          &any_size_,
          learned_matcher_ ? &*learned_matcher_ : nullptr};
}

std::string Eyes::VocabularyDescription() const {
  if (!vocabulary_) return "";
  return std::filesystem::path(vocabulary_file_).filename().string() +
         " sha256:" + vocabulary_->sha256();
}

}  // namespace deepuav
