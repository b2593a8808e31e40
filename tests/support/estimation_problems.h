#pragma once

#include <map>
#include <vector>

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "deepuav/estimation/poses/motion_only.h"
#include "deepuav/estimation/two_views/two_view.h"
#include "support/synthetic_world.h"

namespace deepuav {

/// What a camera at `pose` sees, for motion-only optimisation and absolute pose.
inline std::vector<PoseObservation> ObservePose(const SyntheticWorld& world, const SE3& pose,
                                                const SyntheticNoise& noise, Random* random) {
  std::vector<PoseObservation> observations;
  for (const SyntheticObservation& seen : world.Observe(pose, noise, random)) {
    observations.push_back({world.landmarks_world[seen.landmark], seen.px, 1});
  }
  return observations;
}

struct SyntheticPairs {
  std::vector<PixelPair> pairs;
  std::vector<int> landmark;     ///< One per pair.
  std::vector<uint8_t> outlier;  ///< One per pair.
};

/// The landmarks that both cameras see. The share of outliers is of the pairs.
inline SyntheticPairs ObservePairs(const SyntheticWorld& world, const SE3& a_from_world,
                                   const SE3& b_from_world, const SyntheticNoise& noise,
                                   Random* random) {
  std::map<int, SyntheticObservation> in_a;
  for (const SyntheticObservation& seen :
       world.Observe(a_from_world, {noise.sigma_px, 0}, random)) {
    in_a[seen.landmark] = seen;
  }
  SyntheticPairs result;
  for (const SyntheticObservation& seen : world.Observe(b_from_world, noise, random)) {
    const auto match = in_a.find(seen.landmark);
    if (match == in_a.end()) continue;
    result.pairs.push_back({match->second.px, seen.px});
    result.landmark.push_back(seen.landmark);
    result.outlier.push_back(seen.outlier);
  }
  return result;
}

/// The true poses and landmarks with all they see, first camera fixed. `outlier`, if given,
/// receives one flag an observation.
inline BundleProblem MakeBundleProblem(const SyntheticWorld& world, const SyntheticNoise& noise,
                                       Random* random, std::vector<uint8_t>* outlier = nullptr) {
  BundleProblem problem;
  problem.pinhole = world.pinhole;
  problem.cam_from_world = world.cam_from_world;
  problem.landmarks_world = world.landmarks_world;
  problem.camera_fixed.assign(world.cam_from_world.size(), 0);
  if (!problem.camera_fixed.empty()) problem.camera_fixed[0] = 1;
  for (size_t camera = 0; camera < world.cam_from_world.size(); ++camera) {
    for (const SyntheticObservation& seen :
         world.Observe(world.cam_from_world[camera], noise, random)) {
      problem.observations.push_back({static_cast<int>(camera), seen.landmark, seen.px, 1});
      if (outlier) outlier->push_back(seen.outlier);
    }
  }
  return problem;
}

}  // namespace deepuav
