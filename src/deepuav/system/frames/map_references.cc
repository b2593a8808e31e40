#include "deepuav/system/frames/map_references.h"

#include <algorithm>
#include <utility>

namespace deepuav {
namespace {

/// Ids without their repetitions: many frames see the same.
template <typename IdType>
class IdMarks {
 public:
  void Mark(IdType id) {
    const auto place = static_cast<size_t>(id.value);
    if (place >= marked_.size()) marked_.resize(place + place / 2 + 1);
    marked_[place] = true;
  }
  /// By rising id.
  std::vector<IdType> Marked() const {
    std::vector<IdType> ids;
    for (size_t place = 0; place < marked_.size(); ++place) {
      if (marked_[place]) ids.push_back({static_cast<int64_t>(place)});
    }
    return ids;
  }

 private:
  std::vector<bool> marked_;
};

/// The keys of `removed` that are referred to or new.
template <typename IdType, typename Value>
std::vector<IdType> ToKeep(const std::map<IdType, Value>& removed,
                           const std::vector<IdType>& referred, const std::vector<IdType>& known) {
  std::vector<IdType> kept;
  for (const auto& [id, value] : removed) {
    if (std::binary_search(referred.begin(), referred.end(), id) ||
        !std::binary_search(known.begin(), known.end(), id))
      kept.push_back(id);
  }
  return kept;
}

}  // namespace

MapReferences ReferencesOf(const std::vector<FrameRecord>& records, const LocalMap* local_map) {
  IdMarks<KeyframeId> keyframes;
  IdMarks<LandmarkId> landmarks;
  for (const FrameRecord& record : records) {
    if (record.located()) keyframes.Mark(record.pose.keyframe);
    for (const FrameRecord::Seen& seen : record.seen) landmarks.Mark(seen.landmark);
  }
  if (local_map) {
    for (const LocalKeyframe& keyframe : local_map->keyframes) keyframes.Mark(keyframe.id);
    for (const LocalLandmark& landmark : local_map->landmarks) landmarks.Mark(landmark.id);
  }
  return {keyframes.Marked(), landmarks.Marked()};
}

void RemovedForgetter::Forget(MapReferences referred, Atlas* atlas) {
  const std::vector<MapId> maps = atlas->Remaining();
  for (const MapId map : maps) {
    const auto keyframes = ToKeep(atlas->At(map).culled(), referred.keyframes, known_.keyframes);
    const auto landmarks =
        ToKeep(atlas->At(map).merged_into(), referred.landmarks, known_.landmarks);
    atlas->At(map).ForgetRemovedBut(keyframes, landmarks);
  }
  known_ = std::move(referred);
  known_.keyframes.clear();
  known_.landmarks.clear();
  for (const MapId map : maps) {
    for (const auto& [id, culled] : atlas->At(map).culled()) known_.keyframes.push_back(id);
    for (const auto& [id, into] : atlas->At(map).merged_into()) known_.landmarks.push_back(id);
  }
  std::sort(known_.keyframes.begin(), known_.keyframes.end());
  std::sort(known_.landmarks.begin(), known_.landmarks.end());
}

}  // namespace deepuav
