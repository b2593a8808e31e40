#pragma once

#include <functional>
#include <map>
#include <vector>

#include "deepuav/base/ids.h"
#include "deepuav/place/bag_of_words.h"

namespace deepuav {

/// Finds the keyframes that look like an image, by an inverted index from words to keyframes.
/// Results do not depend on the order of Add and Remove. Const use is thread-safe.
class PlaceIndex {
 public:
  struct Hit {
    KeyframeId keyframe;
    float similarity = 0;  ///< As Similarity() gives it, to the bit.
    int shared_words = 0;

    bool operator==(const Hit&) const = default;
  };

  /// Throws Error for a keyframe that is there already, and for a bag whose words do not rise or
  /// are negative.
  void Add(KeyframeId keyframe, BagOfWords words);
  /// Throws Error for a keyframe that is not there, as At does.
  void Remove(KeyframeId keyframe);

  bool Contains(KeyframeId keyframe) const { return slots_.contains(keyframe); }
  const BagOfWords& At(KeyframeId keyframe) const;
  int size() const { return static_cast<int>(slots_.size()); }

  /// The keyframes that share words with the image, most similar first, equal ones by rising id, at
  /// most `max_hits`; without those for which `skip`, if given, is true.
  std::vector<Hit> Query(const BagOfWords& words, int max_hits,
                         const std::function<bool(KeyframeId)>& skip = {}) const;

 private:
  /// A keyframe's place in the index, free for the next one after its removal.
  struct Slot {
    KeyframeId keyframe;
    BagOfWords words;
  };
  struct Posting {
    int slot = 0;
    float weight = 0;
  };

  int SlotOf(KeyframeId keyframe) const;

  std::map<KeyframeId, int> slots_;
  std::vector<Slot> by_slot_;
  std::vector<int> free_slots_;
  std::vector<std::vector<Posting>> postings_;  ///< By word.
};

}  // namespace deepuav
