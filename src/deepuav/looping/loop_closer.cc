#include "deepuav/looping/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "deepuav/base/logging.h"
#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/looping/drift.h"

namespace deepuav {
namespace {

RelocaliserOptions ForVerifying(const LoopingOptions& options) {
  RelocaliserOptions relocaliser = options.relocaliser;
  int& samples = relocaliser.absolute_pose.max_iterations;
  samples = std::min(samples, options.verifier.max_samples);
  return relocaliser;
}

std::vector<LoopTie> TiesOf(const std::vector<LoopFinding>& findings) {
  std::vector<LoopTie> ties;
  for (const LoopFinding& finding : findings) ties.push_back(finding.tie);
  return ties;
}

bool IsPlace(KeyframeId keyframe, const std::vector<LoopTie>& ties) {
  return std::any_of(ties.begin(), ties.end(),
                     [&](const LoopTie& tie) { return tie.place == keyframe; });
}

/// The keyframe, its covisible ones and theirs: what it sees there is no loop. A few landmarks in
/// common do not count: they may be chance where a loop comes near its beginning.
std::set<KeyframeId> Surroundings(const Map& map, KeyframeId keyframe, int min_shared) {
  std::set<KeyframeId> near = {keyframe};
  for (KeyframeId id : map.Covisible(keyframe, min_shared, map.KeyframeCount())) {
    near.insert(id);
    for (KeyframeId next : map.Covisible(id, min_shared, map.KeyframeCount())) near.insert(next);
  }
  return near;
}

}  // namespace

void LoopingOptions::Check() const { CheckOptions("looping", *this); }

void LoopingOptions::CheckRelations() const {
  CheckOption(memory_keyframes >= agreeing_keyframes, "memory_keyframes", memory_keyframes,
              "at least looping.agreeing_keyframes");
}

LoopCloser::LoopCloser(const Camera& camera, const LoopingOptions& options,
                       const LocatorOptions& locator, PlaceMemory* places, PlaceMatchers matchers,
                       StageListener* stages)
    : camera_(camera),
      options_(options),
      stages_(stages),
      places_(places),
      relocaliser_(camera, ForVerifying(options), locator, matchers, nullptr),
      verifier_(camera.pinhole, options.verifier, &relocaliser_) {
  options_.Check();
}

QuarterTurns LoopCloser::TurnsFor(const Atlas& atlas, MapId map, KeyframeId keyframe) const {
  for (MapId id : atlas.Remaining()) {
    if (id != map && atlas.At(id).KeyframeCount() > 0) return kAllTurns;
  }
  QuarterTurns turns = {};
  const bool will_rest = processed_ + 1 <= rest_until_;
  if (will_rest) return turns;
  const Map& own = atlas.At(map);
  const SE3& camera = own.At(keyframe).cam_from_world;
  const std::set<KeyframeId> near = Surroundings(own, keyframe, options_.min_near_shared);
  own.keyframes().ForEach([&](const Keyframe& place) {
    if (turns == kAllTurns || near.contains(place.id)) return;
    const QuarterTurns here = TurnsToTry(camera, place.cam_from_world, options_.turns);
    for (size_t i = 0; i < turns.size(); ++i) turns[i] = turns[i] || here[i];
  });
  return turns;
}

std::optional<MapCorrection> LoopCloser::Process(const Atlas& atlas, MapId map, KeyframeId keyframe,
                                                 std::span<const Descriptors> turned) {
  ++processed_;
  Forget(atlas);
  std::optional<LoopFinding> finding = Find(atlas, map, keyframe, turned);
  if (!finding) return std::nullopt;
  const std::vector<LoopFinding> agreeing = AgreeingWith(atlas, *finding);
  Log().debug("keyframe {}: {} keyframes agree on it", keyframe.value, agreeing.size());
  findings_.push_back({std::move(*finding), processed_});
  if (static_cast<int>(agreeing.size()) < options_.agreeing_keyframes) return std::nullopt;
  const StageScope stage(stages_, "correct loop");
  MapCorrection correction = MakeCorrection(atlas, agreeing);
  findings_.clear();
  rest_until_ = processed_ + options_.rest_keyframes;
  return correction;
}

std::optional<LoopFinding> LoopCloser::Find(const Atlas& atlas, MapId map, KeyframeId keyframe,
                                            std::span<const Descriptors> turned) {
  const Keyframe& query = atlas.At(map).At(keyframe);
  const std::set<KeyframeId> near = Surroundings(atlas.At(map), keyframe, options_.min_near_shared);
  const bool resting = processed_ <= rest_until_;
  const auto skip = [&](KeyframeId other) {
    return near.contains(other) || (resting && atlas.At(map).Contains(other));
  };
  std::vector<PlaceCandidate> places;
  {
    const StageScope stage(stages_, "recognise place");
    places = places_->PlacesLike(atlas, query.features(), turned, skip);
  }
  if (places.empty()) return std::nullopt;
  const StageScope stage(stages_, "verify place");
  std::string reason;
  auto finding = verifier_.Verify(atlas, map, keyframe, turned, places, &reason);
  const bool within_map = finding && finding->map == finding->place_map;
  if (within_map && !CanHaveDrifted(atlas.At(map), *finding, options_.drift, &reason))
    finding.reset();
  if (finding) {
    Log().debug("keyframe {} is at keyframe {}: {} landmarks, scale {:.3f}", keyframe.value,
                finding->tie.place.value, finding->tie.seen.size(),
                finding->place_from_map_world.scale());
  } else {
    Log().debug("keyframe {} looks like keyframe {} ({:.3f}) of {}: {}", keyframe.value,
                places.front().keyframe.value, places.front().similarity, places.size(), reason);
  }
  return finding;
}

/// Findings grow old, and outlive the keyframes they are about and maps that were merged.
void LoopCloser::Forget(const Atlas& atlas) {
  std::erase_if(findings_, [&](const Remembered& remembered) {
    const LoopFinding& finding = remembered.finding;
    if (processed_ - remembered.processed >= options_.memory_keyframes) return true;
    const Map& map = atlas.At(finding.map);
    const Map& place_map = atlas.At(finding.place_map);
    return map.id() != finding.map || place_map.id() != finding.place_map ||
           !map.Contains(finding.tie.keyframe) || !place_map.Contains(finding.tie.place);
  });
}

std::vector<LoopFinding> LoopCloser::AgreeingWith(const Atlas& atlas,
                                                  const LoopFinding& newest) const {
  std::vector<LoopFinding> agreeing;
  for (const Remembered& earlier : findings_) {
    if (Agree(atlas, earlier.finding, newest)) agreeing.push_back(earlier.finding);
  }
  agreeing.push_back(newest);
  return agreeing;
}

bool LoopCloser::Agree(const Atlas& atlas, const LoopFinding& earlier,
                       const LoopFinding& newest) const {
  if (earlier.map != newest.map || earlier.place_map != newest.place_map) return false;
  const double scale_ratio =
      earlier.place_from_map_world.scale() / newest.place_from_map_world.scale();
  if (std::abs(std::log(scale_ratio)) > options_.max_scale_disagreement) return false;
  const SE3 by_earlier = earlier.place_from_map_world.MovePose(
      atlas.At(newest.map).At(newest.tie.keyframe).cam_from_world);
  std::vector<double> distances_px;
  for (const LandmarkMatch& match : newest.tie.seen) {
    const Map& place_map = atlas.At(newest.place_map);
    if (!place_map.Contains(match.landmark)) continue;
    const Eigen::Vector3d& position = place_map.At(match.landmark).position_world;
    const Eigen::Vector3d there = by_earlier * position;
    const Eigen::Vector3d here = newest.cam_from_place_world * position;
    if (there.z() <= 0 || here.z() <= 0) return false;
    distances_px.push_back((camera_.pinhole.Project(there) - camera_.pinhole.Project(here)).norm());
  }
  return !distances_px.empty() && Median(distances_px) <= options_.max_disagreement_px;
}

MapCorrection LoopCloser::MakeCorrection(const Atlas& atlas,
                                         const std::vector<LoopFinding>& findings) const {
  const LoopFinding& newest = findings.back();
  MapCorrection correction{newest.map, newest.place_map, newest.place_from_map_world, {}, {}};
  correction.ties = TiesOf(findings);
  const std::vector<LoopTie> all = correction.ties;
  std::erase_if(correction.ties, [&](const LoopTie& tie) { return IsPlace(tie.keyframe, all); });
  if (correction.merges()) return correction;

  const Map& map = atlas.At(newest.map);
  std::map<KeyframeId, Sim3> moved;
  for (const LoopTie& tie : correction.ties) moved[tie.keyframe] = newest.place_from_map_world;
  for (KeyframeId id :
       map.Covisible(newest.tie.keyframe, options_.min_near_shared, options_.moved_keyframes)) {
    if (!IsPlace(id, correction.ties)) moved[id] = newest.place_from_map_world;
  }
  correction.keyframes =
      OptimiseEssentialGraph(map, moved, correction.ties, options_.essential_graph);
  return correction;
}

}  // namespace deepuav
