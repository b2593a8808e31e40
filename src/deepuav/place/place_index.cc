#include "deepuav/place/place_index.h"

#include <algorithm>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

void CheckBag(const BagOfWords& words) {
  for (size_t i = 0; i < words.size(); ++i) {
    const int least = i == 0 ? 0 : words[i - 1].word + 1;
    if (words[i].word < least) {
      throw Error("word {} of a bag of words is {}: expected at least {}", i, words[i].word, least);
    }
  }
}

}  // namespace

int PlaceIndex::SlotOf(KeyframeId keyframe) const {
  const auto found = slots_.find(keyframe);
  if (found == slots_.end())
    throw Error("keyframe {} is not in the index of places", keyframe.value);
  return found->second;
}

void PlaceIndex::Add(KeyframeId keyframe, BagOfWords words) {
  CheckBag(words);
  if (Contains(keyframe))
    throw Error("keyframe {} is in the index of places already", keyframe.value);
  if (free_slots_.empty()) {
    free_slots_.push_back(static_cast<int>(by_slot_.size()));
    by_slot_.emplace_back();
  }
  const int slot = free_slots_.back();
  free_slots_.pop_back();
  slots_[keyframe] = slot;
  if (!words.empty() && words.back().word >= static_cast<int>(postings_.size()))
    postings_.resize(static_cast<size_t>(words.back().word) + 1);
  for (const auto& [word, weight] : words)
    postings_[static_cast<size_t>(word)].push_back({slot, weight});
  by_slot_[static_cast<size_t>(slot)] = {keyframe, std::move(words)};
}

void PlaceIndex::Remove(KeyframeId keyframe) {
  const int slot = SlotOf(keyframe);
  for (const auto& [word, weight] : by_slot_[static_cast<size_t>(slot)].words) {
    std::vector<Posting>& postings = postings_[static_cast<size_t>(word)];
    const auto found =
        std::find_if(postings.begin(), postings.end(),
                     [slot](const Posting& posting) { return posting.slot == slot; });
    *found = postings.back();
    postings.pop_back();
  }
  by_slot_[static_cast<size_t>(slot)] = {};
  free_slots_.push_back(slot);
  slots_.erase(keyframe);
}

const BagOfWords& PlaceIndex::At(KeyframeId keyframe) const {
  return by_slot_[static_cast<size_t>(SlotOf(keyframe))].words;
}

std::vector<PlaceIndex::Hit> PlaceIndex::Query(const BagOfWords& words, int max_hits,
                                               const std::function<bool(KeyframeId)>& skip) const {
  std::vector<Hit> by_slot(by_slot_.size());
  for (const auto& [word, weight] : words) {
    if (word < 0 || word >= static_cast<int>(postings_.size())) continue;
    for (const Posting& posting : postings_[static_cast<size_t>(word)]) {
      Hit& hit = by_slot[static_cast<size_t>(posting.slot)];
      hit.similarity += std::min(weight, posting.weight);
      ++hit.shared_words;
    }
  }
  std::vector<Hit> hits;
  for (size_t slot = 0; slot < by_slot.size(); ++slot) {
    Hit& hit = by_slot[slot];
    hit.keyframe = by_slot_[slot].keyframe;
    if (hit.shared_words > 0 && !(skip && skip(hit.keyframe))) hits.push_back(hit);
  }
  const auto count = std::min(hits.size(), static_cast<size_t>(std::max(max_hits, 0)));
  std::partial_sort(hits.begin(), hits.begin() + static_cast<ptrdiff_t>(count), hits.end(),
                    [](const Hit& a, const Hit& b) {
                      return a.similarity != b.similarity ? a.similarity > b.similarity
                                                          : a.keyframe < b.keyframe;
                    });
  hits.resize(count);
  return hits;
}

}  // namespace deepuav
