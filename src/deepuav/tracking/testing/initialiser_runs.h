#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/tracking/initialiser.h"
#include "support/synthetic_map.h"

namespace deepuav {

inline SE3 At(const Eigen::Vector3d& centre) {
  return SE3(Eigen::Quaterniond::Identity(), -centre);
}

inline FeatureWorld BoxWorld() {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(900, {-14, -8, 8}, {18, 8, 25}, &random);
  return FeatureWorld(geometry, 2);
}

inline FeatureWorld GroundWorld(double relief, double to_x = 90, int landmarks = 1200) {
  Random random(1);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksOnGround(landmarks, {-70, -50}, {to_x, 50}, relief, &random);
  return FeatureWorld(geometry, 2);
}

struct Start {
  std::optional<InitialMapRequest> request;
  int frames = 0;
  std::string waiting_for;
};

inline Start Feed(const FeatureWorld& world, const std::vector<SE3>& poses,
                  const FeatureNoise& noise, uint64_t seed = 5) {
  Random random(seed);
  NearestNeighbourMatcher matcher({});
  Initialiser initialiser(world.camera(), {}, {}, &matcher);
  Start start;
  for (const SE3& pose : poses) {
    const SyntheticView view = world.View(pose, noise, &random);
    start.request = initialiser.Add(FrameOf(start.frames++, view), &start.waiting_for);
    if (start.request) break;
  }
  return start;
}

inline void ExpectTrue(const InitialMapRequest& request, const std::vector<SE3>& poses) {
  const SE3& first = poses[static_cast<size_t>(request.first.id.value)];
  const SE3& second = poses[static_cast<size_t>(request.second.id.value)];
  const SE3 truth = second * first.Inverse();
  EXPECT_LT((request.second_from_first * truth.Inverse()).Angle(), 0.01);
  const double cosine =
      request.second_from_first.translation().normalized().dot(truth.translation().normalized());
  EXPECT_GT(cosine, std::cos(0.1)) << "direction of travel";
  EXPECT_GT(request.points.size(), 60u);
}

inline std::vector<SE3> SidewaysPath(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) {
    poses.push_back(SE3(RotationExp({0.001 * i, -0.002 * i, 0}), {-0.12 * i, 0.01 * i, 0.02 * i}));
  }
  return poses;
}

inline std::vector<SE3> NadirPath(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) poses.push_back(LookDown({0.5 * i, 0.05 * i, 40}, 0.01 * i));
  return poses;
}

}  // namespace deepuav
