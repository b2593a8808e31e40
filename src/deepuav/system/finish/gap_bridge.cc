#include "deepuav/system/finish/gap_bridge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/median.h"
#include "deepuav/base/option_check.h"
#include "deepuav/map/landmark_noise.h"
#include "deepuav/system/frames/frame_path.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kMinPaceChanges = 10;  // fewer tell no noise of motion: then the whole map's do

/// More than what is known of the path's pose explains.
bool IsFarFrom(const SE3& cam_from_world, const GapPath::Pose& pose) {
  constexpr double kContradictingSigmas = 10;
  const Eigen::Vector3d apart =
      cam_from_world.InverseTranslation() - pose.cam_from_world.InverseTranslation();
  return apart.norm() > kContradictingSigmas * PositionSigma(pose);
}

}  // namespace

void GapOptions::Check() const { CheckOptions("gaps", *this); }

/// A stretch as it is worked on.
struct GapBridge::Stretch {
  PathStretch gap;
  const Map* map = nullptr;
  GapPathProblem problem;
  std::vector<uint8_t> is_keyframe;                       ///< One per frame.
  std::vector<uint8_t> is_lost;                           ///< One per frame: it has no pose.
  std::vector<FrameId> ids;                               ///< One per frame.
  std::vector<std::shared_ptr<const Features>> features;  ///< One per frame; may be null.
  std::vector<KeyframeId> near;  ///< Keyframes of the poses at the ends of its gaps.
};

GapBridge::GapBridge(const GapSight& sight, const GapOptions& options, const Atlas& atlas,
                     std::vector<std::shared_ptr<const Features>> features)
    : sight_(sight),
      options_(options),
      linker_(sight.camera, sight.matcher, options),
      atlas_(atlas),
      features_(std::move(features)) {
  options_.Check();
}

int GapBridge::Bridge(std::vector<FrameRecord>* records, const std::function<bool()>& stop) const {
  int placed = 0;
  if (!options_.enabled) return placed;
  const PathGapLimits limits{options_.max_gap_s, options_.max_rim_s, options_.firm_landmarks};
  for (const PathStretch& gap : FindPathGaps(atlas_, *records, limits)) {
    if (stop && stop()) break;
    placed += BridgeOne(gap, stop, records);
  }
  return placed;
}

int GapBridge::BridgeOne(const PathStretch& gap, const std::function<bool()>& stop,
                         std::vector<FrameRecord>* records) const {
  Stretch stretch = Begin(gap, *records);
  const auto solve = [&](bool covariances) -> std::optional<GapPath> {
    if (stop && stop()) return std::nullopt;
    GapPathOptions options;
    options.covariances = covariances;
    return SolveGapPath(sight_.camera.pinhole, stretch.problem, options);
  };
  const auto& first = (*records)[gap.first];
  const auto stays = [&first](const char* reason) {
    Log().info("frames lost after frame {} stay so: {}", first.id.value, reason);
    return 0;
  };
  const auto no_path = [&stop] {
    return stop && stop() ? "the run was stopped" : "no path leads from pose to pose";
  };
  if (!stretch.problem.motion.usable() || !(stretch.problem.scene.mean > 0))
    return stays("nothing tells how the camera moves");
  std::optional<GapPath> path = solve(true);
  if (!path) return stays(no_path());
  linker_.Link(*path, stretch.ids, stretch.features, stop, &stretch.problem);
  path = solve(false);
  if (path) {
    linker_.DropDoubtful(*path, &stretch.problem);
    path = solve(false);
  }
  for (const double radius_px :
       {sight_.locator.predicted_radius_px, sight_.locator.local_radius_px}) {
    if (!path) break;
    LookForLandmarks(*path, radius_px, &stretch);
    path = solve(true);
  }
  if (!path) return stays(no_path());
  if (Contradicts(stretch, *path)) return stays("before and after contradict each other");
  return Take(stretch, *path, records);
}

GapBridge::Stretch GapBridge::Begin(const PathStretch& gap,
                                    const std::vector<FrameRecord>& records) const {
  Stretch stretch;
  stretch.gap = gap;
  stretch.map = &atlas_.At(records[gap.first].map);
  std::map<FrameId, const Keyframe*> keyframes;
  stretch.map->keyframes().ForEach(
      [&](const Keyframe& keyframe) { keyframes.emplace(keyframe.frame.id, &keyframe); });
  for (size_t i = gap.first; i <= gap.last; ++i) {
    const FrameRecord& record = records[i];
    const auto keyframe = keyframes.find(record.id);
    const bool is_keyframe = record.located() && keyframe != keyframes.end() &&
                             keyframe->second->frame.time == record.time;
    stretch.is_keyframe.push_back(is_keyframe);
    stretch.features.push_back(is_keyframe ? keyframe->second->frame.features : features_[i]);
    stretch.is_lost.push_back(!record.located());
    stretch.ids.push_back(record.id);
    stretch.problem.frames.push_back(Place(records, i, &stretch));
  }
  std::sort(stretch.near.begin(), stretch.near.end());
  stretch.near.erase(std::unique(stretch.near.begin(), stretch.near.end()), stretch.near.end());
  stretch.problem.motion = MotionAbout(stretch, records);
  stretch.problem.scene = SceneOf(stretch, records);
  return stretch;
}

PathFrame GapBridge::Place(const std::vector<FrameRecord>& records, size_t i,
                           Stretch* stretch) const {
  const FrameRecord& record = records[i];
  PathFrame frame;
  frame.time_s = SecondsBetween(records[stretch->gap.first].time, record.time);
  frame.is_known = stretch->gap.holds[i - stretch->gap.first];
  frame.cam_from_world = record.cam_from_world;
  if (record.located()) {
    if (!frame.is_known)
      frame.landmarks = ObservationsOf(*stretch->map, record, record.cam_from_world);
    return frame;
  }
  size_t before = i, after = i;
  while (!records[before].located()) --before;
  while (!records[after].located()) ++after;
  const FrameRecord &first = records[before], &last = records[after];
  frame.cam_from_world = InterpolatePose({first.time, first.cam_from_world.Inverse()},
                                         {last.time, last.cam_from_world.Inverse()}, record.time)
                             .world_from_cam.Inverse();
  for (const FrameRecord* end : {&first, &last})
    stretch->near.push_back(stretch->map->Remaining(end->pose.keyframe));
  return frame;
}

MotionNoise GapBridge::MotionAbout(const Stretch& stretch,
                                   const std::vector<FrameRecord>& records) const {
  const Timestamp first = records[stretch.gap.first].time, last = records[stretch.gap.last].time;
  Trajectory all, near;
  std::vector<double> steps_s;
  for (size_t i = 0; i < records.size(); ++i) {
    const FrameRecord& record = records[i];
    if (i > 0) steps_s.push_back(SecondsBetween(records[i - 1].time, record.time));
    if (!record.located() || atlas_.Current(record.map) != stretch.map->id()) continue;
    if (!record.reckoned && record.landmark_count < options_.firm_landmarks) continue;
    const TimedPose pose{record.time, record.cam_from_world.Inverse()};
    all.push_back(pose);
    if (SecondsBetween(record.time, first) <= options_.motion_window_s &&
        SecondsBetween(last, record.time) <= options_.motion_window_s)
      near.push_back(pose);
  }
  // A step over frames without a pose says nothing of the moments between.
  const double max_step_s = 1.5 * Median(steps_s);
  const MotionNoise noise = MeasureMotionNoise(near, max_step_s, kMinPaceChanges);
  return noise.usable() ? noise : MeasureMotionNoise(all, max_step_s, kMinPaceChanges);
}

InverseDepth GapBridge::SceneOf(const Stretch& stretch,
                                const std::vector<FrameRecord>& records) const {
  std::vector<double> inverse;
  for (size_t i = stretch.gap.first; i <= stretch.gap.last; ++i) {
    for (const FrameRecord::Seen& seen : records[i].seen) {
      const auto landmark = stretch.map->Current(seen.landmark);
      if (!landmark) continue;
      const double depth =
          (records[i].cam_from_world * stretch.map->At(*landmark).position_world).z();
      if (depth > 0) inverse.push_back(1 / depth);
    }
  }
  if (inverse.empty()) return {};
  const double mean = Median(inverse);
  double squares = 0;
  for (const double value : inverse) squares += (value - mean) * (value - mean);
  // What comes into view need not lie where all seen before does.
  return {mean, std::max(std::sqrt(squares / static_cast<double>(inverse.size())), 0.5 * mean)};
}

void GapBridge::LookForLandmarks(const GapPath& path, double radius_px, Stretch* stretch) const {
  std::vector<std::shared_ptr<const LocalMap>> surroundings;
  for (const KeyframeId keyframe : stretch->near)
    surroundings.push_back(MakeLocalMap(*stretch->map, keyframe, sight_.local_map));
  for (size_t i = 0; i < stretch->problem.frames.size(); ++i) {
    PathFrame& frame = stretch->problem.frames[i];
    frame.cam_from_world = path.poses[i].cam_from_world;
    if (!stretch->is_lost[i] || !stretch->features[i]) continue;
    const Features& features = *stretch->features[i];
    const KeypointGrid grid(features);
    std::vector<uint8_t> taken(features.keypoints.size(), 0);
    frame.landmarks.clear();
    for (const auto& local_map : surroundings)
      AddLandmarksOf(*local_map, features, grid, radius_px, &taken, &frame);
  }
}

void GapBridge::AddLandmarksOf(const LocalMap& local_map, const Features& features,
                               const KeypointGrid& grid, double radius_px,
                               std::vector<uint8_t>* taken, PathFrame* frame) const {
  std::vector<ProjectionTarget> targets;
  for (size_t k = 0; k < local_map.landmarks.size(); ++k) {
    const auto px = ExpectedPixel(local_map.landmarks[k], frame->cam_from_world, sight_.camera,
                                  sight_.locator.visibility);
    if (px) targets.push_back({*px, radius_px, static_cast<int>(k)});
  }
  for (const Match& match :
       MatchProjected(targets, local_map.descriptors, features, grid, sight_.locator.projection)) {
    const auto at = static_cast<size_t>(match.b);
    if (std::exchange((*taken)[at], 1)) continue;
    const Keypoint& keypoint = features.keypoints[at];
    const ProjectionTarget& target = targets[static_cast<size_t>(match.a)];
    const LocalLandmark& landmark = local_map.landmarks[static_cast<size_t>(target.descriptor)];
    const PixelNoise noise =
        PixelNoise(keypoint.sigma_px) +
        ExpectedPixelNoise(landmark.position_noise, landmark.position_world, frame->cam_from_world);
    frame->landmarks.push_back({landmark.position_world, keypoint.px.cast<double>(), noise});
  }
}

bool GapBridge::Contradicts(const Stretch& stretch, const GapPath& path) const {
  // Without an image only the ends contradict each other; each image may contradict the motion.
  const bool is_linked = !stretch.problem.links.empty();
  const double steps = is_linked ? static_cast<double>(stretch.problem.frames.size() - 1) : 1;
  const double bound = options_.max_misfit * options_.max_misfit * 6 * steps;
  return path.travel_chi_square > bound || path.turn_chi_square > bound;
}

std::vector<uint8_t> GapBridge::WhatImagesTell(const Stretch& stretch, const GapPath& path) const {
  const std::vector<PathFrame>& frames = stretch.problem.frames;
  std::vector<uint8_t> step_is_seen = linker_.StepsSeen(stretch.problem, path);
  for (size_t i = 0; i + 1 < frames.size(); ++i) {
    if (!stretch.is_lost[i] && !stretch.is_lost[i + 1]) step_is_seen[i] = 1;
  }
  std::vector<uint8_t> told(frames.size(), 1);
  for (size_t i = 0; i < step_is_seen.size();) {
    size_t end = i;
    while (end < step_is_seen.size() && !step_is_seen[end]) ++end;
    if (frames[end].time_s - frames[i].time_s > options_.max_unseen_s) {
      for (size_t k = i + 1; k < end; ++k) told[k] = 0;
    }
    i = end + 1;
  }
  return told;
}

int GapBridge::Take(const Stretch& stretch, const GapPath& path,
                    std::vector<FrameRecord>* records) const {
  const std::vector<uint8_t> told = WhatImagesTell(stretch, path);
  int placed = 0;
  for (size_t i = 0; i < path.poses.size(); ++i) {
    if (stretch.problem.frames[i].is_known) continue;
    const GapPath::Pose& pose = path.poses[i];
    FrameRecord& record = (*records)[stretch.gap.first + i];
    const double position_sigma = PositionSigma(pose) * stretch.problem.scene.mean;
    const double turn_sigma = std::sqrt(pose.covariance.bottomRightCorner<3, 3>().trace());
    Log().debug("frame {}: {:.4f} of the distance, {:.2f} degrees, {} landmarks", record.id.value,
                position_sigma, turn_sigma / kDegree, pose.landmark_count);
    const bool is_sure = told[i] && position_sigma <= options_.max_position_sigma &&
                         turn_sigma <= kDegree * options_.max_turn_sigma_deg;
    if (!is_sure) continue;
    const bool was_lost = !record.located();
    // Keyframes stay where the map has them, unless that cannot be.
    if (stretch.is_keyframe[i] && !IsFarFrom(record.cam_from_world, pose)) continue;
    const FrameRecord& first = (*records)[stretch.gap.first];
    const Keyframe& anchor = stretch.map->At(stretch.map->Remaining(first.pose.keyframe));
    record.map = stretch.map->id();
    record.pose = {anchor.id, pose.cam_from_world * anchor.cam_from_world.Inverse(), anchor.scale};
    record.cam_from_world = pose.cam_from_world;
    record.pose_information = pose.covariance.inverse();
    if (!was_lost) continue;
    record.inferred = true;
    record.landmark_count = pose.landmark_count;
    ++placed;
  }
  return placed;
}

}  // namespace deepuav
