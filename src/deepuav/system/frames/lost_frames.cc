#include "deepuav/system/frames/lost_frames.h"

#include <cmath>

namespace deepuav {

LostFrames::LostFrames(const Camera& camera, const SystemOptions& options, PlaceMemory* places,
                       TurnedDescriber* turned, PlaceMatchers matchers, StageListener* stages)
    : places_(places),
      turned_(turned),
      local_map_(options.mapping.local_map),
      min_keypoints_(options.tracking.relocaliser.min_inliers),
      turned_interval_s_(options.turned_interval_s),
      relocaliser_(camera, options.tracking.relocaliser, options.tracking.locator, matchers,
                   stages) {}

bool LostFrames::MayFind(const Frame& frame) const {
  return places_ && frame.features->size() >= min_keypoints_;
}

std::optional<LostFrames::Recognised> LostFrames::Find(const Frame& frame, const Atlas& atlas) {
  if (!MayFind(frame) || atlas.Remaining().empty()) return std::nullopt;
  std::optional<Recognised> found = FindUnder(frame, {}, atlas);
  if (!found && turned_ && TurnsAt(frame.time))
    found = FindUnder(frame, turned_->Describe(frame.image->image(), *frame.features), atlas);
  return found;
}

std::optional<LostFrames::Recognised> LostFrames::FindUnder(const Frame& frame,
                                                            std::span<const Descriptors> turned,
                                                            const Atlas& atlas) {
  std::vector<LocalMapPtr> surroundings;
  std::vector<int> headings;
  for (const PlaceCandidate& place : places_->PlacesLike(atlas, *frame.features, turned)) {
    surroundings.push_back(MakeLocalMap(atlas.At(place.map), place.keyframe, local_map_));
    headings.push_back(place.view);
  }
  if (surroundings.empty()) return std::nullopt;
  auto found = relocaliser_.Relocalise(frame, turned, surroundings, nullptr, headings);
  if (!found) return std::nullopt;
  return Recognised{surroundings[static_cast<size_t>(found->candidate)], std::move(found->located)};
}

bool LostFrames::TurnsAt(Timestamp time) {
  const bool due = !turned_at_ || std::abs(SecondsBetween(*turned_at_, time)) >= turned_interval_s_;
  if (due) turned_at_ = time;
  return due;
}

}  // namespace deepuav
