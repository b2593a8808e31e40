#include "deepuav/estimation/bundle/bundle_structure.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

constexpr int kMinObservationsPerLandmark = 2;

/// From counts to the begin of each bin; one element more for the end.
std::vector<int> BinBegins(const std::vector<int>& counts) {
  std::vector<int> begins(counts.size() + 1, 0);
  std::partial_sum(counts.begin(), counts.end(), begins.begin() + 1);
  return begins;
}

}  // namespace

bool UsableObservation(const BundleObservation& observation) {
  return observation.px.allFinite() && observation.noise.usable();
}

void CheckBundleProblem(const BundleProblem& problem) {
  const Pinhole& p = problem.pinhole;
  if (!(p.fx > 0 && p.fy > 0 &&
        std::isfinite(p.fx + p.fy + p.cx + p.cy + problem.k1 + problem.k2))) {
    throw Error(
        "bundle problem: found fx {} fy {} cx {} cy {} k1 {} k2 {}, expected finite values, fx and "
        "fy > 0",
        p.fx, p.fy, p.cx, p.cy, problem.k1, problem.k2);
  }
  if (problem.camera_fixed.size() != problem.cam_from_world.size()) {
    throw Error("bundle problem: camera_fixed has {} entries, expected one for each of {} cameras",
                problem.camera_fixed.size(), problem.cam_from_world.size());
  }
  for (size_t i = 0; i < problem.cam_from_world.size(); ++i) {
    const SE3& pose = problem.cam_from_world[i];
    if (!pose.translation().allFinite() || !pose.rotation().coeffs().allFinite()) {
      throw Error("bundle problem: the pose of camera {} is not finite", i);
    }
  }
  const int cameras = static_cast<int>(problem.cam_from_world.size());
  const int landmarks = static_cast<int>(problem.landmarks_world.size());
  CheckCameraFactors(problem.factors, cameras);
  for (size_t i = 0; i < problem.observations.size(); ++i) {
    const BundleObservation& o = problem.observations[i];
    if (o.camera < 0 || o.camera >= cameras || o.landmark < 0 || o.landmark >= landmarks) {
      throw Error(
          "bundle problem: observation {} is of camera {}, landmark {}; expected below {} and {}",
          i, o.camera, o.landmark, cameras, landmarks);
    }
  }
}

int BundleStructure::parts() const {
  constexpr size_t kWorthParts = 20000;  // observations: threads gain nothing below
  constexpr int kParts = 8;
  return observations.size() < kWorthParts ? 1 : kParts;
}

BundleStructure::BundleStructure(const BundleProblem& problem) {
  std::vector<int> seen(problem.landmarks_world.size(), 0);
  for (const BundleObservation& o : problem.observations) seen[o.landmark] += UsableObservation(o);
  std::vector<int> group_of_landmark(seen.size(), -1), group_sizes;
  for (size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] < kMinObservationsPerLandmark || !problem.landmarks_world[i].allFinite()) continue;
    group_of_landmark[i] = groups();
    landmark_of_group.push_back(static_cast<int>(i));
    group_sizes.push_back(seen[i]);
  }
  const auto takes_part = [&](const BundleObservation& o) {
    return group_of_landmark[o.landmark] >= 0 && UsableObservation(o);
  };

  free_of_camera.assign(problem.cam_from_world.size(), -1);
  for (const BundleObservation& o : problem.observations) {
    if (takes_part(o) && !problem.camera_fixed[o.camera]) free_of_camera[o.camera] = 0;
  }
  for (size_t i = 0; i < free_of_camera.size(); ++i) {
    if (free_of_camera[i] < 0) continue;
    free_of_camera[i] = free_cameras();
    camera_of_free.push_back(static_cast<int>(i));
  }

  factors = problem.factors;
  camera_pairs = CameraPairs(factors, free_of_camera);

  group_begin = BinBegins(group_sizes);
  observations.resize(group_begin.back());
  std::vector<int> next = group_begin;
  for (const BundleObservation& o : problem.observations) {
    if (!takes_part(o)) continue;
    const int group = group_of_landmark[o.landmark];
    observations[next[group]++] = {o.camera, free_of_camera[o.camera], group,
                                   o.px,     Whitening(o.noise),       o.drift_cam_per_s};
  }
  std::vector<int> camera_sizes(free_cameras(), 0);
  for (int group = 0; group < groups(); ++group) {
    std::stable_sort(observations.begin() + group_begin[group],
                     observations.begin() + group_begin[group + 1],
                     [](const GroupedObservation& a, const GroupedObservation& b) {
                       return a.free_camera < b.free_camera;
                     });
  }
  for (const GroupedObservation& o : observations) {
    if (o.free_camera >= 0) ++camera_sizes[o.free_camera];
  }
  camera_begin = BinBegins(camera_sizes);
  camera_observations.resize(camera_begin.back());
  next = camera_begin;
  for (size_t i = 0; i < observations.size(); ++i) {
    const int camera = observations[i].free_camera;
    if (camera >= 0) camera_observations[next[camera]++] = static_cast<int>(i);
  }
}

}  // namespace deepuav
