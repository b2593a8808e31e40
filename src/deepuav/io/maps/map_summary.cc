#include "deepuav/io/maps/map_summary.h"

#include <algorithm>
#include <vector>

#include "deepuav/io/maps/map_export.h"

namespace deepuav {
namespace {

double Median(std::vector<int64_t> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const auto upper = static_cast<double>(*middle);
  if (values.size() % 2 == 1) return upper;
  return 0.5 * (upper + static_cast<double>(*std::max_element(values.begin(), middle)));
}

void AddKeyframes(const Map& map, MapSummary* summary) {
  summary->keyframes = map.KeyframeCount();
  summary->removed_keyframes = static_cast<int>(map.culled().size());
  map.keyframes().ForEach([&](const Keyframe& keyframe) {
    summary->keypoints += keyframe.features().size();
    summary->descriptor_dimension = keyframe.features().descriptors.dimension();
  });
}

void AddPath(const Map& map, MapSummary* summary) {
  const Trajectory path = KeyframeTrajectory(map);
  if (path.empty()) return;
  summary->first_time = path.front().time;
  summary->last_time = path.back().time;
  Eigen::Vector3d before = path.front().world_from_cam.translation();
  for (const TimedPose& pose : path) {
    const Eigen::Vector3d& position = pose.world_from_cam.translation();
    summary->path_length += (position - before).norm();
    summary->cameras.extend(position);
    before = position;
  }
}

void AddLandmarks(const Map& map, MapSummary* summary) {
  summary->landmarks = map.LandmarkCount();
  std::vector<int64_t> counts;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    counts.push_back(static_cast<int64_t>(landmark.observations.size()));
    summary->observations += counts.back();
    summary->points.extend(landmark.position_world);
  });
  summary->median_observations = Median(std::move(counts));
}

}  // namespace

MapSummary SummariseMap(const Map& map) {
  MapSummary summary;
  AddKeyframes(map, &summary);
  AddPath(map, &summary);
  AddLandmarks(map, &summary);
  return summary;
}

}  // namespace deepuav
