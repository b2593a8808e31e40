#pragma once

#include "deepuav/estimation/bundle/bundle_adjustment.h"
#include "support/estimation_problems.h"

namespace deepuav {

inline SyntheticWorld OrbitWorld(uint64_t seed, int cameras, int landmarks) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-5, -5, -3}, {5, 5, 3}, &random);
  world.cam_from_world = OrbitPath(cameras, {0, 0, 0}, 12, 3, 1.5);
  return world;
}

/// Moves all free cameras and all landmarks off the truth.
inline void Disturb(double camera_translation, double camera_rotation, double landmark,
                    Random* random, BundleProblem* problem) {
  for (size_t i = 0; i < problem->cam_from_world.size(); ++i) {
    if (problem->camera_fixed[i]) continue;
    problem->cam_from_world[i] =
        Perturbed(problem->cam_from_world[i], camera_translation, camera_rotation, random);
  }
  for (auto& point : problem->landmarks_world) point += landmark * RandomDirection(random);
}

inline double WorstCentreError(const BundleProblem& problem, const SyntheticWorld& world) {
  double worst = 0;
  for (size_t i = 0; i < world.cam_from_world.size(); ++i) {
    worst = std::max(worst, (problem.cam_from_world[i].InverseTranslation() -
                             world.cam_from_world[i].InverseTranslation())
                                .norm());
  }
  return worst;
}

inline BundleOptions Precise() {
  BundleOptions options;
  options.max_iterations = 50;
  options.min_relative_decrease = 1e-9;
  return options;
}

}  // namespace deepuav
