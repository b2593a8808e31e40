#include "deepuav/system/finish/bent_start.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/system/finish/neighbour_location.h"
#include "deepuav/system/frames/frame_path.h"

namespace deepuav {
namespace {

using Records = std::vector<const FrameRecord*>;

Records LocatedIn(MapId map, const std::vector<FrameRecord>& records) {
  Records located;
  for (const FrameRecord& record : records) {
    if (record.map == map) located.push_back(&record);
  }
  return located;
}

std::map<FrameId, KeyframeId> KeyframesOf(const Map& map, KeyframeId first_new) {
  std::map<FrameId, KeyframeId> keyframes;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    if (keyframe.id >= first_new) keyframes.emplace(keyframe.frame.id, keyframe.id);
  });
  return keyframes;
}

/// The map without some of its keyframes, by id; nothing where none is left.
std::optional<Map> Without(const Map& map, const std::vector<KeyframeId>& young) {
  Map later = map;
  KeyframeId root;
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    if (!root.valid() && !std::ranges::binary_search(young, keyframe.id)) root = keyframe.id;
  });
  if (!root.valid()) return std::nullopt;
  later.Reroot(root);
  for (const KeyframeId id : young) later.RemoveKeyframe(id);
  return later;
}

}  // namespace

void BentStartOptions::Check() const { CheckOptions("bent_start", *this); }

/// A first keyframe, as the later map sees it.
struct BentStart::Found {
  KeyframeId keyframe;
  FrameRecord record;
  LocatedFrame located;
  std::vector<LandmarkMatch> matches;
};

BentStart::BentStart(const Pinhole& pinhole, const BentStartOptions& options,
                     const LocalMapOptions& local_map_options, int first_frames,
                     KeyframeId first_new_keyframe, FrameLocator* locator)
    : pinhole_(pinhole),
      options_(options),
      local_map_options_(local_map_options),
      first_frames_(static_cast<size_t>(first_frames)),
      first_new_keyframe_(first_new_keyframe),
      locator_(locator) {}

std::vector<KeyframeRelocation> BentStart::FindIn(const Map& map,
                                                  const std::vector<FrameRecord>& records,
                                                  const std::function<bool()>& stop) const {
  const Records located = LocatedIn(map.id(), records);
  if (!options_.enabled || located.size() <= first_frames_ || first_frames_ == 0) return {};
  const FrameId last_young = located[first_frames_ - 1]->id;
  std::vector<KeyframeId> young;
  for (const auto& [frame, keyframe] : KeyframesOf(map, first_new_keyframe_)) {
    if (frame <= last_young) young.push_back(keyframe);
  }
  std::ranges::sort(young);
  const auto later = Without(map, young);
  if (!later || later->KeyframeCount() < options_.min_later_keyframes) return {};
  std::vector<KeyframeRelocation> wrong;
  for (Found& found : LocateBackwards(map, *later, located, first_frames_, stop)) {
    if (!IsWrong(map.At(found.keyframe), *later, found.record)) continue;
    wrong.push_back({found.keyframe, found.located.cam_from_world, std::move(found.located.frame),
                     std::move(found.matches)});
  }
  std::ranges::sort(wrong, {}, &KeyframeRelocation::keyframe);
  return wrong;
}

std::vector<BentStart::Found> BentStart::LocateBackwards(const Map& map, const Map& later,
                                                         const Records& records, size_t young,
                                                         const std::function<bool()>& stop) const {
  const std::map<FrameId, KeyframeId> keyframes = KeyframesOf(map, first_new_keyframe_);
  std::vector<Found> found;
  FrameRecord neighbour = *records[young];
  std::optional<FrameRecord> before;
  if (young + 1 < records.size()) before = *records[young + 1];
  int misses = 0;
  for (size_t i = young; i-- > 0;) {
    if (stop && stop()) break;
    const auto keyframe = keyframes.find(records[i]->id);
    const bool is_keyframe = keyframe != keyframes.end();
    if (!is_keyframe && !records[i]->features) continue;
    const Frame frame = is_keyframe ? map.At(keyframe->second).frame : FrameToLocate(*records[i]);
    const LocationPrior prior =
        PriorBeside(later, neighbour, before ? &*before : nullptr, frame.time);
    const auto local_map = MakeLocalMap(later, prior.reference, local_map_options_);
    auto located = locator_->Locate(frame, *local_map, prior);
    if (!located && ++misses >= options_.max_misses) break;
    if (!located) continue;
    misses = 0;
    TrackedPose pose = PoseIn(*local_map, *located);
    before = std::exchange(neighbour, LocatedRecord(frame, pose));
    if (!is_keyframe) continue;
    found.push_back({keyframe->second, neighbour, std::move(*located), std::move(pose.matches)});
  }
  return found;
}

bool BentStart::IsWrong(const Keyframe& keyframe, const Map& later,
                        const FrameRecord& found) const {
  int agreeing = 0;
  const auto observations = ObservationsOf(later, found, keyframe.cam_from_world);
  for (const PoseObservation& observation : observations) {
    const Eigen::Vector3d in_camera = keyframe.cam_from_world * observation.landmark_world;
    if (in_camera.z() <= 0) continue;
    const Eigen::Vector2d error_px = pinhole_.Project(in_camera) - observation.px;
    if ((Whitening(observation.noise) * error_px).squaredNorm() <= options_.chi_square) ++agreeing;
  }
  const auto seen = static_cast<double>(observations.size());
  Log().debug("keyframe {} saw {} landmarks; of {} later ones {} agree with where it is",
              keyframe.id.value, keyframe.LandmarkCount(), observations.size(), agreeing);
  return seen >= options_.min_later_share * keyframe.LandmarkCount() &&
         agreeing < options_.max_agreeing * seen;
}

}  // namespace deepuav
