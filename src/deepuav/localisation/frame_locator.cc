#include "deepuav/localisation/frame_locator.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "deepuav/base/option_check.h"
#include "deepuav/localisation/seen_landmarks.h"
#include "deepuav/map/frame_motion.h"

namespace deepuav {
namespace {

/// Indices of the landmarks with these ids; ids that the local map has not are left out.
std::vector<int> IndicesOf(const LocalMap& local_map, const std::vector<LandmarkId>& ids) {
  std::vector<int> indices;
  for (LandmarkId id : ids) {
    const auto place =
        std::lower_bound(local_map.landmarks.begin(), local_map.landmarks.end(), id,
                         [](const LocalLandmark& l, LandmarkId wanted) { return l.id < wanted; });
    if (place == local_map.landmarks.end() || place->id != id) continue;
    indices.push_back(static_cast<int>(place - local_map.landmarks.begin()));
  }
  return indices;
}

/// What the frame before saw; all where that is long ago.
std::vector<int> LookedForFirst(const LocalMap& local_map, const LocationPrior& prior) {
  if (!prior.is_reckoned) return IndicesOf(local_map, prior.landmarks);
  std::vector<int> all(local_map.landmarks.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// The wanted keyframe first, then the one the local map was made around, then the newest others.
std::vector<int> ReferenceOrder(const LocalMap& local_map, KeyframeId wanted) {
  std::vector<int> order;
  const auto add = [&order](int index) {
    if (std::find(order.begin(), order.end(), index) == order.end()) order.push_back(index);
  };
  const int count = static_cast<int>(local_map.keyframes.size());
  for (int i = 0; i < count; ++i) {
    if (local_map.keyframes[static_cast<size_t>(i)].id == wanted) add(i);
  }
  add(local_map.centre);
  for (int i = count - 1; i >= 0; --i) add(i);
  return order;
}

void FindReference(const LocalMap& local_map, LocatedFrame* located) {
  std::vector<uint8_t> seen(local_map.landmarks.size(), 0);
  for (const LocatedFrame::Seen& s : located->seen) seen[static_cast<size_t>(s.landmark)] = 1;
  for (size_t k = 0; k < local_map.keyframes.size(); ++k) {
    int shared = 0;
    for (int landmark : local_map.keyframes[k].landmarks)
      shared += landmark >= 0 && seen[static_cast<size_t>(landmark)];
    if (shared < located->reference_shared) continue;
    located->reference = static_cast<int>(k);
    located->reference_shared = shared;
  }
}

}  // namespace

void LocatorOptions::Check() const {
  CheckOptions("tracking", *this);
  patches.Check();
}

FrameLocator::FrameLocator(const Camera& camera, const LocatorOptions& options, Matcher* matcher,
                           StageListener* stages)
    : camera_(camera), options_(options), matcher_(matcher), stages_(stages) {
  options_.Check();
}

std::optional<LocatedFrame> FrameLocator::Locate(const Frame& given, const LocalMap& local_map,
                                                 const LocationPrior& prior, std::string* reason) {
  const Frame frame = prior.cam_from_world ? Moving(given, *prior.cam_from_world, prior) : given;
  const KeypointGrid grid(*frame.features);
  LocatedFrame located;
  const auto refine_if_better = [&](const std::optional<CoarsePose>& coarse, double min_ratio) {
    if (!coarse) return;
    LocatedFrame refined = RefineInRounds(frame, grid, local_map, *coarse);
    const auto seen = static_cast<double>(refined.seen.size());
    if (seen < min_ratio * static_cast<double>(refined.visible.size())) return;
    if (refined.seen.size() > located.seen.size()) located = std::move(refined);
  };
  refine_if_better(FollowPrediction(frame, grid, local_map, prior),
                   prior.is_reckoned ? options_.min_unpredicted_ratio : 0);
  if (IsDoubtful(located, prior)) {
    refine_if_better(MatchReference(frame, local_map, prior), options_.min_unpredicted_ratio);
  }
  if (located.seen.empty()) {
    if (reason) *reason = fmt::format("no pose from {} key points", frame.features->size());
    return std::nullopt;
  }
  if (static_cast<int>(located.seen.size()) < options_.min_inliers) {
    if (reason) *reason = fmt::format("only {} landmarks agree on the pose", located.seen.size());
    return std::nullopt;
  }
  located.frame = Moving(frame, located.cam_from_world, prior);
  if (options_.patches.enabled) Sharpen(local_map, &located);
  if (located.frame.motion.IsNone()) return located;
  for (LocatedFrame::Seen& seen : located.seen) {
    if (!seen.measured)
      seen.measured =
          SeenAtKeypoint(located.frame, local_map, seen, located.cam_from_world, camera_);
  }
  return located;
}

Frame FrameLocator::Moving(const Frame& frame, const SE3& cam_from_world,
                           const LocationPrior& prior) const {
  if (!prior.neighbour) return frame;
  return MovingOn(frame, cam_from_world, prior.neighbour->world_from_cam.Inverse(),
                  SecondsBetween(prior.neighbour->time, frame.time), camera_);
}

void FrameLocator::Sharpen(const LocalMap& local_map, LocatedFrame* located) const {
  const Frame& frame = located->frame;
  if (!frame.image) return;
  const StageScope stage(stages_, "align patches");
  SeenList measured = located->seen;
  for (LocatedFrame::Seen& seen : measured)
    seen.measured =
        SeenByPatch(frame, local_map, seen, located->cam_from_world, camera_, options_.patches);
  CoarsePose sharp = OptimiseOn(frame, local_map, measured, located->cam_from_world);
  if (static_cast<int>(sharp.seen.size()) < options_.min_inliers) return;
  located->cam_from_world = sharp.cam_from_world;
  located->information = sharp.information;
  located->seen = std::move(sharp.seen);
}

bool FrameLocator::IsDoubtful(const LocatedFrame& located, const LocationPrior& prior) const {
  const auto seen = static_cast<double>(located.seen.size());
  return seen < options_.min_inliers ||
         seen < options_.min_predicted_share * static_cast<double>(prior.landmarks.size());
}

std::optional<CoarsePose> FrameLocator::FollowPrediction(const Frame& frame,
                                                         const KeypointGrid& grid,
                                                         const LocalMap& local_map,
                                                         const LocationPrior& prior) const {
  if (!prior.cam_from_world) return std::nullopt;
  const StageScope stage(stages_, "match prediction");
  std::vector<ProjectionTarget> targets;
  const double radius_px =
      prior.is_reckoned ? options_.reckoned_radius_px : options_.predicted_radius_px;
  for (int index : LookedForFirst(local_map, prior)) {
    const auto px = ExpectedPixel(local_map.landmarks[static_cast<size_t>(index)],
                                  *prior.cam_from_world, camera_, options_.visibility);
    if (px) targets.push_back({*px, radius_px, index});
  }
  SeenList seen;
  for (const Match& match :
       MatchProjected(targets, local_map.descriptors, *frame.features, grid, options_.projection)) {
    seen.push_back({match.b, targets[static_cast<size_t>(match.a)].descriptor});
  }
  if (static_cast<int>(seen.size()) < options_.min_predicted_inliers) return std::nullopt;
  CoarsePose pose = OptimiseOn(frame, local_map, seen, *prior.cam_from_world);
  const auto inliers = static_cast<double>(pose.seen.size());
  if (inliers < options_.min_predicted_inliers) return std::nullopt;
  if (inliers < options_.min_predicted_ratio * static_cast<double>(seen.size()))
    return std::nullopt;
  return pose;
}

std::optional<CoarsePose> FrameLocator::MatchReference(const Frame& frame,
                                                       const LocalMap& local_map,
                                                       const LocationPrior& prior) {
  const StageScope stage(stages_, "match reference");
  std::optional<CoarsePose> best;
  int tries = options_.reference_tries;
  for (int index : ReferenceOrder(local_map, prior.reference)) {
    if (tries-- == 0) break;
    const LocalKeyframe& keyframe = local_map.keyframes[static_cast<size_t>(index)];
    const SeenList seen =
        LandmarksOf(matcher_->MatchFeatures(*frame.features, *keyframe.features), keyframe);
    std::optional<CoarsePose> pose = LocateByMatches(frame, local_map, seen);
    if (pose && (!best || pose->seen.size() > best->seen.size())) best = std::move(pose);
    if (best && static_cast<int>(best->seen.size()) >= 2 * options_.min_inliers) break;
  }
  return best;
}

std::optional<CoarsePose> FrameLocator::LocateByMatches(const Frame& frame,
                                                        const LocalMap& local_map,
                                                        const SeenList& seen) const {
  const auto robust = EstimateAbsolutePose(
      camera_.pinhole, PoseObservations(frame, local_map, seen, std::nullopt, camera_),
      static_cast<uint64_t>(frame.id.value), options_.absolute_pose);
  if (!robust) return std::nullopt;
  SeenList agreeing;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (robust->inlier[i]) agreeing.push_back(seen[i]);
  }
  return OptimiseOn(frame, local_map, agreeing, robust->cam_from_world);
}

LocatedFrame FrameLocator::RefineInRounds(const Frame& frame, const KeypointGrid& grid,
                                          const LocalMap& local_map,
                                          const CoarsePose& coarse) const {
  LocatedFrame best;
  size_t before = coarse.seen.size();
  for (int round = 0; round < options_.local_rounds; ++round) {
    const CoarsePose from = round == 0 ? coarse : CoarsePose{best.cam_from_world, best.seen};
    LocatedFrame refined = Refine(frame, grid, local_map, from, options_.local_radius_px);
    if (round > 0 && refined.seen.size() <= best.seen.size()) break;
    best = std::move(refined);
    if (static_cast<double>(best.seen.size()) <
        options_.min_round_growth * static_cast<double>(before))
      break;
    before = best.seen.size();
  }
  return best;
}

LocatedFrame FrameLocator::Refine(const Frame& frame, const KeypointGrid& grid,
                                  const LocalMap& local_map, const CoarsePose& coarse,
                                  double radius_px) const {
  LocatedFrame located;
  SeenList seen = coarse.seen;
  {
    const StageScope stage(stages_, "match local map");
    std::vector<uint8_t> known(local_map.landmarks.size(), 0),
        taken(frame.features->keypoints.size(), 0);
    for (const LocatedFrame::Seen& s : coarse.seen) {
      known[static_cast<size_t>(s.landmark)] = 1;
      taken[static_cast<size_t>(s.keypoint)] = 1;
    }
    std::vector<ProjectionTarget> targets;
    for (size_t i = 0; i < local_map.landmarks.size(); ++i) {
      const auto px = ExpectedPixel(local_map.landmarks[i], coarse.cam_from_world, camera_,
                                    options_.visibility);
      if (!px) continue;
      located.visible.push_back(static_cast<int>(i));
      if (!known[i]) targets.push_back({*px, radius_px, static_cast<int>(i)});
    }
    for (const Match& match : MatchProjected(targets, local_map.descriptors, *frame.features, grid,
                                             options_.projection)) {
      if (taken[static_cast<size_t>(match.b)]) continue;
      seen.push_back({match.b, targets[static_cast<size_t>(match.a)].descriptor});
    }
  }
  const StageScope stage(stages_, "optimise pose");
  CoarsePose refined = OptimiseOn(frame, local_map, seen, coarse.cam_from_world);
  located.cam_from_world = refined.cam_from_world;
  located.information = refined.information;
  located.seen = std::move(refined.seen);
  std::sort(located.seen.begin(), located.seen.end(),
            [](const auto& a, const auto& b) { return a.keypoint < b.keypoint; });
  FindReference(local_map, &located);
  return located;
}

CoarsePose FrameLocator::OptimiseOn(const Frame& frame, const LocalMap& local_map,
                                    const SeenList& seen, const SE3& initial) const {
  const MotionOnlyResult result =
      OptimisePose(camera_.pinhole, PoseObservations(frame, local_map, seen, initial, camera_),
                   initial, options_.motion_only);
  CoarsePose pose{result.cam_from_world, {}, result.information};
  for (size_t i = 0; i < seen.size(); ++i) {
    if (result.inlier[i]) pose.seen.push_back(seen[i]);
  }
  return pose;
}

std::vector<LocatedFrame::Seen> LandmarksOf(const std::vector<Match>& matches,
                                            const LocalKeyframe& keyframe) {
  std::vector<LocatedFrame::Seen> seen;
  for (const Match& match : matches) {
    const int landmark = keyframe.landmarks[static_cast<size_t>(match.b)];
    if (landmark >= 0) seen.push_back({match.a, landmark});
  }
  return seen;
}

std::vector<LandmarkMatch> MatchesOf(const std::vector<LocatedFrame::Seen>& seen,
                                     const LocalMap& local_map) {
  std::vector<LandmarkMatch> matches;
  matches.reserve(seen.size());
  for (const LocatedFrame::Seen& s : seen) {
    const LandmarkId id = local_map.landmarks[static_cast<size_t>(s.landmark)].id;
    matches.push_back({s.keypoint, id, s.measured});
  }
  return matches;
}

}  // namespace deepuav
