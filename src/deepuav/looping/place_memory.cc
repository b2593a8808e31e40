#include "deepuav/looping/place_memory.h"

#include <algorithm>
#include <set>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

/// Which of `maps` holds the keyframe; invalid where none does.
MapId MapOf(const Atlas& atlas, const std::vector<MapId>& maps, KeyframeId keyframe) {
  for (MapId map : maps) {
    if (atlas.At(map).Contains(keyframe)) return map;
  }
  return {};
}

}  // namespace

void RecogniserOptions::Check() const { CheckOptions("looping.recogniser", *this); }

PlaceMemory::PlaceMemory(const Vocabulary* vocabulary, const RecogniserOptions& options)
    : vocabulary_(vocabulary), options_(options) {
  options_.Check();
}

void PlaceMemory::Remember(const Keyframe& keyframe) {
  index_.Add(keyframe.id, vocabulary_->Words(keyframe.features().descriptors));
  remembered_.insert(keyframe.id);
}

void PlaceMemory::ForgetCulled(const Atlas& atlas) {
  const std::vector<MapId> maps = atlas.Remaining();
  for (auto id = remembered_.begin(); id != remembered_.end();) {
    if (MapOf(atlas, maps, *id).valid()) {
      ++id;
      continue;
    }
    index_.Remove(*id);
    id = remembered_.erase(id);
  }
}

std::vector<PlaceCandidate> PlaceMemory::PlacesLike(const Atlas& atlas, const Features& features,
                                                    std::span<const Descriptors> turned,
                                                    const std::function<bool(KeyframeId)>& skip) {
  std::vector<BagOfWords> views = {vocabulary_->Words(features.descriptors)};
  for (const Descriptors& descriptors : turned)
    views.push_back(descriptors.size() > 0 ? vocabulary_->Words(descriptors) : BagOfWords{});
  return Recognise(atlas, views, skip);
}

std::vector<PlaceCandidate> PlaceMemory::Recognise(const Atlas& atlas,
                                                   std::span<const BagOfWords> views,
                                                   const std::function<bool(KeyframeId)>& skip) {
  ForgetCulled(atlas);
  std::map<KeyframeId, PlaceCandidate> similar;  // under the view that fits best
  for (size_t view = 0; view < views.size(); ++view) {
    for (const PlaceIndex::Hit& hit : index_.Query(views[view], options_.max_hits, skip)) {
      if (hit.similarity < options_.min_similarity) break;
      PlaceCandidate& best = similar[hit.keyframe];
      if (hit.similarity <= best.similarity) continue;
      best = {{}, hit.keyframe, hit.similarity, static_cast<int>(view)};
    }
  }
  std::vector<PlaceCandidate> ranked;
  const std::vector<MapId> maps = atlas.Remaining();
  for (const auto& [id, candidate] : similar) {
    ranked.push_back(candidate);
    ranked.back().map = MapOf(atlas, maps, id);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.similarity > b.similarity; });
  std::vector<PlaceCandidate> places;
  std::set<KeyframeId> taken;
  for (const PlaceCandidate& place : ranked) {
    if (static_cast<int>(places.size()) == options_.max_places) break;
    if (place.similarity < options_.min_relative_similarity * ranked.front().similarity) break;
    if (taken.contains(place.keyframe)) continue;
    places.push_back(place);
    for (KeyframeId other :
         atlas.At(place.map).Covisible(place.keyframe, 1, options_.group_keyframes))
      taken.insert(other);
  }
  return places;
}

}  // namespace deepuav
