#pragma once

#include "deepuav/estimation/bundle/bundle_linearisation.h"
#include "support/estimation_problems.h"

namespace deepuav {

/// Of any direction.
inline PixelNoise RandomNoise(Random* random) {
  PixelNoise noise;
  noise.xx = static_cast<float>(random->Uniform(0.3, 4));
  noise.yy = static_cast<float>(random->Uniform(0.3, 4));
  noise.xy = static_cast<float>(random->Uniform(-0.25, 0.25));
  return noise;
}

/// A small problem away from its minimum, with a fixed camera and a landmark that one camera sees
/// twice.
struct SmallProblem {
  SmallProblem() {
    Random random(1);
    SyntheticWorld world;
    world.landmarks_world = LandmarksInBox(12, {-3, -3, -2}, {3, 3, 2}, &random);
    world.cam_from_world = OrbitPath(4, {0, 0, 0}, 10, 2, 1);
    problem = MakeBundleProblem(world, {3, 0}, &random);
    for (BundleObservation& o : problem.observations) o.noise = RandomNoise(&random);
    BundleObservation twice = problem.observations.back();
    twice.px.x() += 2;
    problem.observations.push_back(twice);
    problem.k1 = -0.1;
    problem.k2 = 0.03;
    problem.p1 = 0.01;
    problem.p2 = -0.02;
    problem.readout_s = 0.1;
    for (BundleObservation& o : problem.observations)
      o.drift_cam_per_s = random.Uniform(-0.5, 0.5) * Eigen::Vector3d(1, 0.3, -0.2);
  }
  BundleState State() const {
    return {{problem.pinhole, problem.k1, problem.k2, problem.p1, problem.p2, problem.readout_s},
            problem.cam_from_world,
            problem.landmarks_world};
  }

  BundleProblem problem;
};

}  // namespace deepuav
