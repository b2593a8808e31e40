#pragma once

#include <functional>
#include <set>
#include <span>
#include <vector>

#include "deepuav/base/option_bounds.h"
#include "deepuav/map/atlas.h"
#include "deepuav/place/place_index.h"
#include "deepuav/place/vocabulary.h"

namespace deepuav {

struct RecogniserOptions {
  int max_hits = 30;             ///< Keyframes that look most like the image, before grouping.
  double min_similarity = 0.01;  ///< Of the bags of words.
  double min_relative_similarity = 0.5;  ///< Over the best.
  int group_keyframes = 10;  ///< Covisible keyframes that a better one of them stands for.
  int max_places = 3;        ///< Places to be looked at closer.

  void Check() const;
  template <typename Visitor>
  void Visit(Visitor&& visit) {
    visit("max_hits", max_hits, "", "keyframes that look most like an image, before grouping",
          Between(1, 100'000));
    visit("min_similarity", min_similarity, "", "of the bags of words of image and keyframe",
          Between(0, 1));
    visit("min_relative_similarity", min_relative_similarity, "",
          "similarity over that of the best", Between(0, 1));
    visit("group_keyframes", group_keyframes, "",
          "covisible keyframes that a better one of them stands for", Between(0, 100'000));
    visit("max_places", max_places, "", "places looked at closer", Between(1, 1000));
  }
};

/// A keyframe that looks like an image.
struct PlaceCandidate {
  MapId map;
  KeyframeId keyframe;
  double similarity = 0;
  int view = 0;  ///< Which of the views it resembles most.
};

/// Remembers what keyframes look like and finds those that an image resembles, in all maps of an
/// atlas: for lost frames and for loops alike. Thread-compatible.
class PlaceMemory {
 public:
  /// `vocabulary` must outlive it.
  PlaceMemory(const Vocabulary* vocabulary, const RecogniserOptions& options);

  void Remember(const Keyframe& keyframe);
  bool Remembers(KeyframeId keyframe) const { return index_.Contains(keyframe); }

  /// Places that look like one of `views` (the image under several headings, in words), the most
  /// similar first. The most similar keyframe stands for its group of covisible ones; sums over the
  /// group (Mur-Artal 2015, section VII-A) would favour places with many keyframes. Keyframes for
  /// which `skip` is true, and those no longer in the atlas, are left out.
  std::vector<PlaceCandidate> Recognise(const Atlas& atlas, std::span<const BagOfWords> views,
                                        const std::function<bool(KeyframeId)>& skip = nullptr);
  /// The same of an image; `turned` are its descriptors under other headings, empty where it was
  /// not described, or none.
  std::vector<PlaceCandidate> PlacesLike(const Atlas& atlas, const Features& features,
                                         std::span<const Descriptors> turned,
                                         const std::function<bool(KeyframeId)>& skip = nullptr);

 private:
  void ForgetCulled(const Atlas& atlas);

  const Vocabulary* vocabulary_;
  const RecogniserOptions options_;
  PlaceIndex index_;
  std::set<KeyframeId> remembered_;
};

}  // namespace deepuav
