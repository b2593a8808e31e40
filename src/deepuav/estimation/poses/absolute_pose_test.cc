#include "deepuav/estimation/poses/absolute_pose.h"

#include <gtest/gtest.h>

#include <limits>

#include "deepuav/base/error.h"
#include "support/estimation_problems.h"

namespace deepuav {
namespace {

SyntheticWorld BoxWorld(uint64_t seed, int landmarks) {
  Random random(seed);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-6, -4, 4}, {6, 4, 15}, &random);
  return world;
}

double CentreError(const SE3& a, const SE3& b) {
  return (a.InverseTranslation() - b.InverseTranslation()).norm();
}

TEST(EstimateAbsolutePose, WithNoiseAndFortyPercentOutliers) {
  const SyntheticWorld world = BoxWorld(1, 300);
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = Perturbed(SE3(), 2, 0.2, &random);
    const auto seen = world.Observe(truth, {1, 0.4}, &random);
    ASSERT_GT(seen.size(), 50u);
    std::vector<PoseObservation> observations;
    for (const auto& s : seen) observations.push_back({world.landmarks_world[s.landmark], s.px, 1});
    const auto pose = EstimateAbsolutePose(world.pinhole, observations, 7, {});
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->cam_from_world * truth.Inverse()).Angle(), 0.01);
    EXPECT_LT(CentreError(pose->cam_from_world, truth), 0.1);
    int wrong = 0;
    for (size_t k = 0; k < seen.size(); ++k) wrong += pose->inlier[k] && seen[k].outlier;
    EXPECT_LE(wrong, 3);
    const auto refined = OptimisePose(world.pinhole, observations, pose->cam_from_world, {});
    EXPECT_LT(CentreError(refined.cam_from_world, truth), 0.05);
  }
}

TEST(EstimateAbsolutePose, OfAPlaneSeenFromAbove) {
  Random random(3);
  SyntheticWorld world;
  world.landmarks_world = LandmarksOnGround(300, {-40, -30}, {40, 30}, 0, &random);
  for (int i = 0; i < 20; ++i) {
    const SE3 truth =
        LookDown({random.Uniform(-5, 5), random.Uniform(-5, 5), 40}, random.Uniform(-3, 3));
    const auto observations = ObservePose(world, truth, {1, 0.4}, &random);
    const auto pose = EstimateAbsolutePose(world.pinhole, observations, 7, {});
    ASSERT_TRUE(pose);
    const auto refined = OptimisePose(world.pinhole, observations, pose->cam_from_world, {});
    EXPECT_LT(CentreError(refined.cam_from_world, truth), 0.5);
  }
}

TEST(EstimateAbsolutePose, NothingFromTooFewOrUnrelatedPoints) {
  const SyntheticWorld world = BoxWorld(5, 200);
  Random random(6);
  const auto all = ObservePose(world, SE3(), {0.5, 0}, &random);
  ASSERT_GT(all.size(), 12u);
  for (size_t count : {0u, 1u, 2u, 3u, 4u, 5u, 11u}) {
    EXPECT_FALSE(EstimateAbsolutePose(world.pinhole, {all.begin(), all.begin() + count}, 1, {}))
        << count;
  }
  const auto unrelated = ObservePose(world, SE3(), {0, 1}, &random);
  EXPECT_FALSE(EstimateAbsolutePose(world.pinhole, unrelated, 1, {}));
}

TEST(EstimateAbsolutePose, DegenerateAndBadInputGivesNothingAndNeverThrows) {
  const Pinhole pinhole{450, 450, 376, 240};
  std::vector<PoseObservation> line, point, bad;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d on_line(0.1 * i - 2, 0, 5);
    line.push_back({on_line, pinhole.Project(on_line), 1});
    point.push_back({{0, 0, 5}, {376, 240}, 1});
    bad.push_back({{std::numeric_limits<double>::quiet_NaN(), 0, 5}, {376, 240}, 1});
  }
  EXPECT_NO_THROW(EstimateAbsolutePose(pinhole, line, 1, {}));
  EXPECT_NO_THROW(EstimateAbsolutePose(pinhole, point, 1, {}));
  EXPECT_FALSE(EstimateAbsolutePose(pinhole, bad, 1, {}));
  AbsolutePoseOptions options;
  options.confidence = 1;
  EXPECT_THROW(EstimateAbsolutePose(pinhole, line, 1, options), Error);
}

TEST(EstimateAbsolutePose, PointsBehindTheCameraAreNoInliers) {
  const SyntheticWorld world = BoxWorld(7, 300);
  Random random(8);
  auto observations = ObservePose(world, SE3(), {0.5, 0}, &random);
  const size_t behind = observations.size() / 4;
  for (size_t i = 0; i < behind; ++i) observations[i].landmark_world *= -1;
  const auto pose = EstimateAbsolutePose(world.pinhole, observations, 1, {});
  ASSERT_TRUE(pose);
  EXPECT_LT(CentreError(pose->cam_from_world, SE3()), 0.1);
  for (size_t i = 0; i < behind; ++i) EXPECT_FALSE(pose->inlier[i]);
  EXPECT_EQ(pose->inlier_count, static_cast<int>(observations.size() - behind));
}

TEST(EstimateAbsolutePose, TheSeedAloneDecidesTheSamples) {
  const SyntheticWorld world = BoxWorld(9, 300);
  Random random(10);
  const auto observations = ObservePose(world, SE3(), {1, 0.4}, &random);
  for (uint64_t seed : {0ull, 1ull, 123456789012345ull, ~0ull}) {
    const auto a = EstimateAbsolutePose(world.pinhole, observations, seed, {});
    const auto b = EstimateAbsolutePose(world.pinhole, observations, seed, {});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->cam_from_world.Matrix(), b->cam_from_world.Matrix());
    EXPECT_EQ(a->inlier, b->inlier);
  }
}

}  // namespace
}  // namespace deepuav
