#include "deepuav/estimation/paths/smooth_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

constexpr double kStep_s = 0.1;
constexpr double kSigma = 0.02;
constexpr MotionNoise kMotion{0.01, 0.01};

/// On a bend, looking ahead.
SE3 TrueAt(double time_s) {
  const double angle = 0.3 * time_s;
  const Eigen::Vector3d centre(10 * std::cos(angle), 10 * std::sin(angle), 0.5 * time_s);
  const SE3 world_from_cam(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                           centre);
  return world_from_cam.Inverse();
}

PathPose Known(int i) {
  return {i * kStep_s, TrueAt(i * kStep_s), true, Matrix6d::Zero(), kMotion};
}

PathPose Measured(int i, double sigma, Random* random) {
  Vector6d error;
  for (double& e : error) e = random->Gaussian(sigma);
  return {i * kStep_s, SE3::Exp(error) * TrueAt(i * kStep_s), false,
          Matrix6d::Identity() / (sigma * sigma), kMotion};
}

double CentreError(const SE3& pose, int i) {
  return (pose.InverseTranslation() - TrueAt(i * kStep_s).InverseTranslation()).norm();
}

/// Every tenth is a keyframe.
std::vector<PathPose> NoisyPath(int size, Random* random) {
  std::vector<PathPose> path;
  for (int i = 0; i < size; ++i)
    path.push_back(i % 10 == 0 ? Known(i) : Measured(i, kSigma, random));
  return path;
}

double RmsError(const std::vector<SE3>& poses) {
  double squared = 0;
  for (size_t i = 0; i < poses.size(); ++i)
    squared += std::pow(CentreError(poses[i], static_cast<int>(i)), 2);
  return std::sqrt(squared / static_cast<double>(poses.size()));
}

TEST(SmoothPath, HoldsWhatIsKnownAndBringsTheRestNearer) {
  Random random(1);
  const std::vector<PathPose> path = NoisyPath(101, &random);
  std::vector<SE3> before;
  for (const PathPose& pose : path) before.push_back(pose.cam_from_world);
  const auto smooth = SmoothPath(path, {});
  ASSERT_TRUE(smooth);
  EXPECT_LT(RmsError(*smooth), 0.6 * RmsError(before));
  for (size_t i = 0; i < path.size(); i += 10)
    EXPECT_EQ((*smooth)[i].Matrix(), before[i].Matrix()) << i;
}

TEST(SmoothPath, APoseThatIsKnownBadlyFollowsTheOthers) {
  Random random(2);
  std::vector<PathPose> path = NoisyPath(41, &random);
  for (const int i : {23, 24, 25}) path[static_cast<size_t>(i)] = Measured(i, 0.5, &random);
  const auto smooth = SmoothPath(path, {});
  ASSERT_TRUE(smooth);
  for (const int i : {23, 24, 25}) {
    EXPECT_GT(CentreError(path[static_cast<size_t>(i)].cam_from_world, i), 0.2);
    EXPECT_LT(CentreError((*smooth)[static_cast<size_t>(i)], i), 0.05) << i;
  }
}

TEST(SmoothPath, AnOutlierThatClaimsToBeSureIsNotFollowed) {
  Random random(3);
  std::vector<PathPose> path = NoisyPath(41, &random);
  PathPose& wrong = path[25];
  wrong.cam_from_world =
      SE3::Exp((Vector6d() << 1, -1, 0.5, 0, 0, 0).finished()) * wrong.cam_from_world;
  const auto smooth = SmoothPath(path, {});
  ASSERT_TRUE(smooth);
  EXPECT_LT(CentreError((*smooth)[25], 25), 0.2);
  EXPECT_LT(CentreError((*smooth)[23], 23), 0.1);
}

TEST(SmoothPath, WhatMovesUnsteadilyStaysWhereItIsSeen) {
  Random random(4);
  std::vector<PathPose> path = NoisyPath(21, &random);
  for (PathPose& pose : path) pose.to_next = {1e4, 1e4};
  const auto smooth = SmoothPath(path, {});
  ASSERT_TRUE(smooth);
  for (size_t i = 0; i < path.size(); ++i) {
    const SE3 moved = (*smooth)[i] * path[i].cam_from_world.Inverse();
    EXPECT_LT(moved.Log().norm(), 0.2 * kSigma) << i;
  }
}

TEST(SmoothPath, APoseOfWhichNothingIsKnownLiesBetweenTheOthers) {
  std::vector<PathPose> path;
  for (int i = 0; i < 9; ++i) path.push_back(Known(i));
  path[4].is_known = false;
  path[4].cam_from_world = SE3::Exp((Vector6d() << 3, 1, 2, 0.2, 0, 0).finished()) * TrueAt(0.4);
  const auto smooth = SmoothPath(path, {});
  ASSERT_TRUE(smooth);
  EXPECT_LT(CentreError((*smooth)[4], 4), 0.005);
}

TEST(SmoothPath, NothingOfWhatCannotBeSmoothed) {
  Random random(5);
  std::vector<PathPose> path = NoisyPath(11, &random);
  EXPECT_FALSE(SmoothPath(std::span(path).first(2), {}));
  std::vector<PathPose> at_once = path;
  at_once[5].time_s = at_once[4].time_s;
  EXPECT_FALSE(SmoothPath(at_once, {}));
  path[3].to_next = {};
  EXPECT_FALSE(SmoothPath(path, {}));
}

TEST(SmoothPathOptions, OutOfRangeAreRefused) {
  EXPECT_THROW(SmoothPathOptions{.iterations = 0}.Check(), Error);
}

}  // namespace
}  // namespace deepuav
