#include "deepuav/evaluation/measures/rpe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/evaluation/measures/ate.h"
#include "support/flights.h"

namespace deepuav {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

/// Poses along x at these metres, one a second.
Trajectory AlongX(const std::vector<double>& metres) {
  Trajectory trajectory;
  for (const double x : metres) {
    trajectory.push_back({AtSeconds(static_cast<double>(trajectory.size())),
                          SE3(Eigen::Quaterniond::Identity(), {x, 0, 0})});
  }
  return trajectory;
}

RpeOptions Step(double delta, RpeUnit unit, bool all_pairs = false) {
  RpeOptions options;
  options.delta = delta;
  options.unit = unit;
  options.all_pairs = all_pairs;
  return options;
}

TEST(PosePairs, ByFrames) {
  const Trajectory poses = AlongX({0, 1, 2, 3, 4, 5});
  EXPECT_THAT(SelectPosePairs(poses, Step(2, RpeUnit::kFrames)),
              ElementsAre(Pair(0, 2), Pair(2, 4)));
  EXPECT_THAT(SelectPosePairs(poses, Step(4, RpeUnit::kFrames, true)),
              ElementsAre(Pair(0, 4), Pair(1, 5)));
  EXPECT_THAT(SelectPosePairs(poses, Step(6, RpeUnit::kFrames)), IsEmpty());
}

TEST(PosePairs, ByMetresEndToEnd) {
  EXPECT_THAT(
      SelectPosePairs(AlongX({0, 0.75, 1.5, 1.75, 2.5, 4, 4.25}), Step(1, RpeUnit::kMetres)),
      ElementsAre(Pair(0, 2), Pair(2, 4), Pair(4, 5)));
}

TEST(PosePairs, ByMetresFromEveryPoseWithinTheTolerance) {
  // The path goes back and forth: its length counts, not the distance.
  EXPECT_THAT(SelectPosePairs(AlongX({0, 1, 0, 1.25, 0.35}), Step(2, RpeUnit::kMetres, true)),
              ElementsAre(Pair(0, 2), Pair(2, 4)));
}

TEST(PosePairs, BySeconds) {
  Trajectory poses;
  for (const double stamp : {0.0, 0.5, 1.05, 1.5, 2.0, 4.0, 5.0}) {
    poses.push_back({AtSeconds(stamp), SE3()});
  }
  EXPECT_THAT(SelectPosePairs(poses, Step(1, RpeUnit::kSeconds, true)),
              ElementsAre(Pair(0, 2), Pair(1, 3), Pair(2, 4), Pair(5, 6)));
  EXPECT_THAT(SelectPosePairs(poses, Step(1, RpeUnit::kSeconds)),
              ElementsAre(Pair(0, 2), Pair(2, 4), Pair(5, 6)));
}

TEST(RelativeError, OfAPathAndItselfIsNothing) {
  const Trajectory truth = MakeFlight(100, 20);
  const auto error = ComputeRelativeError(truth, truth, Step(5, RpeUnit::kFrames));
  ASSERT_TRUE(error);
  EXPECT_EQ(error->pairs.size(), 19u);
  EXPECT_LT(error->translation_m.max, 1e-12);
  EXPECT_LT(error->rotation_deg->max, 1e-6);
}

TEST(RelativeError, DoesNotDependOnTheWorld) {
  const Trajectory truth = MakeFlight(100, 20);
  const SE3 world_change(RotationExp({1, -0.5, 2}), {7, 8, 9});
  const auto error = ComputeRelativeError(truth, MoveTrajectory(Sim3(world_change), truth),
                                          Step(1, RpeUnit::kFrames, true));
  ASSERT_TRUE(error);
  EXPECT_LT(error->translation_m.max, 1e-10);
  EXPECT_LT(error->rotation_deg->max, 1e-6);
}

TEST(RelativeError, OfAKnownDriftIsTheDriftPerStep) {
  // Each step of the estimate turns by 0.01 rad and goes 0.02 m too far.
  const SE3 drift(RotationExp({0, 0, 0.01}), {0.02, 0, 0});
  const Trajectory truth = MakeFlight(100, 20);
  Trajectory estimate = {truth.front()};
  for (size_t i = 1; i < truth.size(); ++i) {
    const SE3 step = truth[i - 1].world_from_cam.Inverse() * truth[i].world_from_cam;
    estimate.push_back({truth[i].time, estimate.back().world_from_cam * step * drift});
  }
  const auto error = ComputeRelativeError(truth, estimate, Step(1, RpeUnit::kFrames));
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->translation_m.mean, 0.02, 1e-9);
  EXPECT_NEAR(error->translation_m.std, 0, 1e-9);
  EXPECT_NEAR(error->rotation_deg->rmse, 0.01 * 180 / std::numbers::pi, 1e-9);
}

TEST(RelativeError, ScaleErrorShowsInStepsOfMetres) {
  const Trajectory truth = AlongX({0, 1, 2, 3, 4});
  const Trajectory estimate = AlongX({0, 1.1, 2.2, 3.3, 4.4});
  const auto error = ComputeRelativeError(truth, estimate, Step(1, RpeUnit::kMetres));
  ASSERT_TRUE(error);
  EXPECT_NEAR(error->translation_m.mean, 0.1, 1e-12);
}

TEST(RelativeError, PairsCanFollowTheTruth) {
  const Trajectory truth = AlongX({0, 1, 2, 3, 4});
  const Trajectory estimate = AlongX({0, 0.5, 1, 1.5, 2});
  RpeOptions options = Step(2, RpeUnit::kMetres);
  EXPECT_EQ(ComputeRelativeError(truth, estimate, options)->pairs.size(), 1u);
  options.pairs_from_truth = true;
  EXPECT_EQ(ComputeRelativeError(truth, estimate, options)->pairs.size(), 2u);
}

TEST(RelativeError, WithoutPairsIsNothing) {
  const Trajectory truth = MakeFlight(10, 20);
  EXPECT_FALSE(ComputeRelativeError(truth, truth, Step(100, RpeUnit::kMetres)));
  EXPECT_FALSE(ComputeRelativeError({}, {}, Step(1, RpeUnit::kFrames)));
  EXPECT_FALSE(ComputeRelativeDistanceError(truth, truth, Step(10, RpeUnit::kSeconds)));
}

TEST(RelativeError, OfDistancesNeedsNoOrientation) {
  Trajectory truth = AlongX({0, 1, 2, 3});
  Trajectory estimate = truth;
  for (size_t i = 0; i < truth.size(); ++i) {
    estimate[i].world_from_cam =
        SE3(RotationExp({0, 0, 0.3 * static_cast<double>(i)}),
            truth[i].world_from_cam.translation() * 1.5 + Eigen::Vector3d(0, 0, i % 2 ? 2 : 0));
  }
  const auto horizontal =
      ComputeRelativeDistanceError(truth, estimate, Step(1, RpeUnit::kFrames), true);
  ASSERT_TRUE(horizontal);
  EXPECT_FALSE(horizontal->rotation_deg);
  EXPECT_NEAR(horizontal->translation_m.max, 0.5, 1e-12);
  const auto spatial = ComputeRelativeDistanceError(truth, estimate, Step(1, RpeUnit::kFrames));
  EXPECT_NEAR(spatial->translation_m.max, 1.5, 1e-12);
}

TEST(RelativeError, BadInputIsRefused) {
  const Trajectory truth = MakeFlight(10, 20);
  EXPECT_THROW(ComputeRelativeError(truth, {}, {}), Error);
  EXPECT_THROW(Step(1.5, RpeUnit::kFrames).Check(), Error);
  EXPECT_THROW(Step(0, RpeUnit::kMetres).Check(), Error);
  EXPECT_THROW(Step(NAN, RpeUnit::kMetres).Check(), Error);
  EXPECT_NO_THROW(Step(1.5, RpeUnit::kMetres).Check());
}

}  // namespace
}  // namespace deepuav
