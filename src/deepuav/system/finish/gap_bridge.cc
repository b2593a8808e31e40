#include "deepuav/system/finish/gap_bridge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "deepuav/base/logging.h"
#include "deepuav/base/option_check.h"
#include "deepuav/estimation/poses/bearing_rotation.h"
#include "deepuav/map/landmark_noise.h"
#include "deepuav/system/frames/frame_path.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kMinPaceChanges = 10;  // fewer tell no noise of motion: then the whole map's do
constexpr int kRotationTries = 200;
constexpr double kToleranceSigmas = 3;
constexpr double kMaxToleranceRatio = 0.1;  // of the image's width: room beyond says nothing

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double PositionSigma(const GapPath::Pose& pose) {
  return std::sqrt(pose.covariance.topLeftCorner<3, 3>().trace());
}

/// Turns frame by frame, with what is missing to the last one's known orientation spread over all.
void TurnAlong(const std::vector<Eigen::Quaterniond>& next_from_frame, size_t first, size_t last,
               std::vector<PathFrame>* frames) {
  std::vector<Eigen::Quaterniond> cam_from_world = {(*frames)[first].cam_from_world.rotation()};
  for (size_t i = first; i < last; ++i)
    cam_from_world.push_back(next_from_frame[i] * cam_from_world.back());
  const Eigen::Quaterniond missing =
      (*frames)[last].cam_from_world.rotation() * cam_from_world.back().conjugate();
  const double whole_s = (*frames)[last].time_s - (*frames)[first].time_s;
  for (size_t i = first + 1; i < last; ++i) {
    PathFrame& frame = (*frames)[i];
    const double share = (frame.time_s - (*frames)[first].time_s) / whole_s;
    const Eigen::Quaterniond rotation =
        Eigen::Quaterniond::Identity().slerp(share, missing) * cam_from_world[i - first];
    const Eigen::Vector3d centre = frame.cam_from_world.InverseTranslation();
    frame.cam_from_world = SE3(rotation, -(rotation * centre));
  }
}

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
    : sight_(sight), options_(options), atlas_(atlas), features_(std::move(features)) {
  options_.Check();
}

int GapBridge::Bridge(std::vector<FrameRecord>* records, const std::function<bool()>& stop) const {
  int placed = 0;
  if (!options_.enabled) return placed;
  const PathGapLimits limits{options_.max_gap_s, options_.max_rim_s, options_.firm_landmarks};
  for (const PathStretch& gap : FindPathGaps(atlas_, *records, limits)) {
    if (stop && stop()) break;
    placed += BridgeOne(gap, records);
  }
  return placed;
}

int GapBridge::BridgeOne(const PathStretch& gap, std::vector<FrameRecord>* records) const {
  Stretch stretch = Begin(gap, *records);
  const auto solve = [&] { return SolveGapPath(sight_.camera.pinhole, stretch.problem, {}); };
  const auto& first = (*records)[gap.first];
  const auto stays = [&first](const char* reason) {
    Log().info("frames lost after frame {} stay so: {}", first.id.value, reason);
    return 0;
  };
  if (!stretch.problem.motion.usable() || !(stretch.problem.scene.mean > 0))
    return stays("nothing tells how the camera moves");
  std::optional<GapPath> path = solve();
  if (!path) return stays("no path leads from pose to pose");
  LinkFrames(*path, &stretch);
  path = solve();
  if (path) {
    DropDoubtfulLinks(*path, &stretch);
    path = solve();
  }
  for (const double radius_px :
       {sight_.locator.predicted_radius_px, sight_.locator.local_radius_px}) {
    if (!path) break;
    LookForLandmarks(*path, radius_px, &stretch);
    path = solve();
  }
  if (!path) return stays("no path leads from pose to pose");
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

double GapBridge::TolerancePx(const Stretch& stretch, const GapPath& path, size_t a,
                              size_t b) const {
  const GapPath::Pose &from = path.poses[a], &to = path.poses[b];
  const double apart =
      (from.cam_from_world.InverseTranslation() - to.cam_from_world.InverseTranslation()).norm() +
      kToleranceSigmas * std::hypot(PositionSigma(from), PositionSigma(to));
  const InverseDepth& scene = stretch.problem.scene;
  const double parallax_px =
      sight_.camera.pinhole.fx * apart * (scene.mean + kToleranceSigmas * scene.sigma);
  const double noise_px = kToleranceSigmas * M_SQRT2;
  return noise_px + std::min(parallax_px, kMaxToleranceRatio * sight_.camera.width);
}

void GapBridge::LinkFrames(const GapPath& start, Stretch* stretch) const {
  std::vector<PathFrame>& frames = stretch->problem.frames;
  std::vector<Eigen::Quaterniond> next_from_frame;
  for (size_t i = 0; i < frames.size(); ++i)
    frames[i].cam_from_world = start.poses[i].cam_from_world;
  for (size_t a = 0; a + 1 < frames.size(); ++a) {
    std::optional<Eigen::Quaterniond> turn;
    for (const size_t b : {a + 1, a + 2}) {
      if (b >= frames.size() || (frames[a].is_known && frames[b].is_known)) continue;
      const auto found = Link(a, b, TolerancePx(*stretch, start, a, b), stretch);
      if (b == a + 1) turn = found;
    }
    next_from_frame.push_back(turn.value_or(frames[a + 1].cam_from_world.rotation() *
                                            frames[a].cam_from_world.rotation().conjugate()));
  }
  size_t known = 0;
  for (size_t i = 1; i < frames.size(); ++i) {
    if (!frames[i].is_known) continue;
    TurnAlong(next_from_frame, known, i, &frames);
    known = i;
  }
}

std::optional<Eigen::Quaterniond> GapBridge::Link(size_t a, size_t b, double tolerance_px,
                                                  Stretch* stretch) const {
  const auto &of_a = stretch->features[a], &of_b = stretch->features[b];
  if (!of_a || !of_b) return std::nullopt;
  std::vector<PixelPair> pixels;
  std::vector<double> sigmas_px;
  for (const Match& match : sight_.matcher->MatchFeatures(*of_a, *of_b)) {
    const Keypoint& in_a = of_a->keypoints[static_cast<size_t>(match.a)];
    const Keypoint& in_b = of_b->keypoints[static_cast<size_t>(match.b)];
    pixels.push_back({in_a.px.cast<double>(), in_b.px.cast<double>()});
    sigmas_px.push_back(std::hypot(in_a.sigma_px, in_b.sigma_px));
  }
  const auto turn =
      EstimateBearingRotation(sight_.camera.pinhole, pixels, tolerance_px, kRotationTries,
                              static_cast<uint64_t>(stretch->ids[a].value));
  if (!turn || turn->inlier_count < options_.min_pairs ||
      turn->inlier_count < options_.min_pair_ratio * static_cast<double>(pixels.size()))
    return std::nullopt;
  FrameLink link{static_cast<int>(a), static_cast<int>(b), {}};
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (turn->inlier[i]) link.pairs.push_back({pixels[i].a_px, pixels[i].b_px, sigmas_px[i]});
  }
  stretch->problem.links.push_back(std::move(link));
  return turn->b_from_a;
}

bool GapBridge::Holds(const Stretch& stretch, const GapPath& path, size_t link) const {
  const int agreeing = path.link_inlier_count[link];
  const auto all = static_cast<double>(stretch.problem.links[link].pairs.size());
  return agreeing >= options_.min_pairs && agreeing >= options_.min_pair_ratio * all;
}

void GapBridge::DropDoubtfulLinks(const GapPath& path, Stretch* stretch) const {
  std::vector<FrameLink> holding;
  for (size_t k = 0; k < stretch->problem.links.size(); ++k) {
    if (Holds(*stretch, path, k)) holding.push_back(std::move(stretch->problem.links[k]));
  }
  stretch->problem.links = std::move(holding);
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
  std::vector<uint8_t> step_is_seen(frames.size() - 1, 0);
  for (size_t i = 0; i + 1 < frames.size(); ++i)
    step_is_seen[i] = !stretch.is_lost[i] && !stretch.is_lost[i + 1];
  for (size_t k = 0; k < stretch.problem.links.size(); ++k) {
    if (!Holds(stretch, path, k)) continue;
    const FrameLink& link = stretch.problem.links[k];
    std::fill(step_is_seen.begin() + link.a, step_is_seen.begin() + link.b, 1);
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
