#include "deepuav/matching/epipolar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "deepuav/base/error.h"
#include "support/synthetic_features.h"

namespace deepuav {
namespace {

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

FeatureWorld BoxWorld(int landmarks) {
  Random random(1);
  SyntheticWorld world;
  world.landmarks_world = LandmarksInBox(landmarks, {-8, -5, 6}, {8, 5, 20}, &random);
  return FeatureWorld(world, 2);
}

std::vector<int> All(const SyntheticView& view) {
  std::vector<int> all(view.landmark.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Two views of a world, with which match is right.
struct ViewPair {
  SyntheticView a, b;
  SE3 b_from_a;
  Pinhole pinhole;

  ViewPair(const FeatureWorld& world, const SE3& a_from_world, const SE3& b_from_world,
           const FeatureNoise& noise, uint64_t seed)
      : b_from_a(b_from_world * a_from_world.Inverse()), pinhole(world.world().pinhole) {
    Random random(seed);
    a = world.View(a_from_world, noise, &random);
    b = world.View(b_from_world, noise, &random);
  }
  std::vector<Match> Matches(const EpipolarOptions& options = {}) const {
    return MatchEpipolar(*a.features, All(a), *b.features, All(b), pinhole, b_from_a, options);
  }
  bool Right(const Match& match) const {
    return a.landmark[static_cast<size_t>(match.a)] == b.landmark[static_cast<size_t>(match.b)];
  }
  int Shared() const {
    int shared = 0;
    for (int landmark : a.landmark) {
      if (landmark < 0) continue;
      shared += std::find(b.landmark.begin(), b.landmark.end(), landmark) != b.landmark.end();
    }
    return shared;
  }
};

TEST(FundamentalFromPose, PixelsOfAPointLieOnOneAnothersLines) {
  Random random(3);
  const Pinhole pinhole{450, 430, 376, 240};
  for (int i = 0; i < 200; ++i) {
    const SE3 b_from_a = Perturbed(SE3(), random.Uniform(0.1, 2), random.Uniform(0, 0.5), &random);
    const Eigen::Vector3d point(random.Uniform(-3, 3), random.Uniform(-3, 3),
                                random.Uniform(5, 20));
    const Eigen::Vector3d in_b = b_from_a * point;
    const Eigen::Matrix3d fundamental = FundamentalFromPose(pinhole, b_from_a);
    const Eigen::Vector3d line = fundamental * pinhole.Project(point).homogeneous();
    const double distance_px =
        line.dot(pinhole.Project(in_b).homogeneous()) / line.head<2>().norm();
    ASSERT_NEAR(distance_px, 0, 1e-8);
    // And another point's does not.
    const Eigen::Vector3d other = in_b + Eigen::Vector3d(0.3, 0.3, 0);
    if (std::abs(line.normalized().head<2>().normalized().sum()) > 0.3) {
      ASSERT_GT(std::abs(line.dot(pinhole.Project(other).homogeneous())) / line.head<2>().norm(),
                1);
    }
  }
}

TEST(KeepEpipolar, KeepsTheMatchesOnTheirLines) {
  const FeatureWorld world = BoxWorld(500);
  const ViewPair pair(world, At({0, 0, 0}), At({0.8, 0.1, 0}), {0.2, 0.3, 0, 0}, 4);
  Random random(5);
  std::vector<Match> matches = pair.Matches();
  const auto right = static_cast<size_t>(
      std::count_if(matches.begin(), matches.end(), [&](const Match& m) { return pair.Right(m); }));
  for (int i = 0; i < 500; ++i) {
    matches.push_back(
        {random.Index(pair.a.features->size()), random.Index(pair.b.features->size())});
  }
  const auto kept =
      KeepEpipolar(matches, *pair.a.features, *pair.b.features, pair.pinhole, pair.b_from_a, {});
  EXPECT_GE(kept.size(), right);
  EXPECT_LT(kept.size(), right + 40) << "a band of 4 px is a hundredth of the image";
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.begin() + static_cast<ptrdiff_t>(right),
                             [](const Match& m, const Match& n) { return m.a < n.a; }))
      << "the order stays";
}

TEST(KeepEpipolar, NothingNearTheEpipole) {
  const FeatureWorld world = BoxWorld(500);
  const ViewPair pair(world, At({0, 0, 0}), At({0, 0, 1}), {0, 0.3, 0, 0}, 6);
  EpipolarOptions all;
  all.min_epipole_distance_px = 0;
  const auto matches = pair.Matches(all);
  const auto kept = KeepEpipolar(matches, *pair.a.features, *pair.b.features, pair.pinhole,
                                 pair.b_from_a, {.min_epipole_distance_px = 100});
  EXPECT_FALSE(kept.empty());
  EXPECT_LT(kept.size(), matches.size());
  const Eigen::Vector2d centre = pair.pinhole.Project({0, 0, 1});
  for (const Match& match : kept) {
    const Eigen::Vector2f px = pair.b.features->keypoints[static_cast<size_t>(match.b)].px;
    EXPECT_GE((px.cast<double>() - centre).norm(), 100 - 1e-3);
  }
}

TEST(KeepEpipolar, NothingWithoutABaseline) {
  const FeatureWorld world = BoxWorld(100);
  const ViewPair pair(world, At({0, 0, 0}), At({0, 0, 0}), {}, 7);
  EXPECT_TRUE(KeepEpipolar({{0, 0}, {1, 1}}, *pair.a.features, *pair.b.features, pair.pinhole,
                           pair.b_from_a, {})
                  .empty());
}

TEST(MatchEpipolar, FindsTheTrueMatches) {
  const FeatureWorld world = BoxWorld(500);
  const ViewPair views(world, SE3(), At({1, 0.2, 0.1}), {0.5, 0.3, 0, 50}, 4);
  const std::vector<Match> matches = views.Matches();
  EXPECT_GT(views.Shared(), 150);
  EXPECT_GT(static_cast<double>(matches.size()), 0.97 * views.Shared());
  for (size_t i = 0; i < matches.size(); ++i) {
    EXPECT_TRUE(views.Right(matches[i]));
    if (i > 0) {
      EXPECT_LT(matches[i - 1].a, matches[i].a);
    }
  }
}

TEST(MatchEpipolar, RefusesDescriptorsThatAgreeAwayFromTheLine) {
  const FeatureWorld world = BoxWorld(500);
  const ViewPair views(world, SE3(), At({1, 0.2, 0.1}), {0.5, 0.2, 0.4, 0}, 5);
  const std::vector<Match> matches = views.Matches();
  int wrong = 0;
  for (const Match& match : matches) wrong += !views.Right(match);
  // Both views must carry the right descriptor, so 36 % of the shared ones are left.
  EXPECT_GT(static_cast<double>(matches.size()), 0.3 * views.Shared());
  EXPECT_LT(wrong, 0.06 * static_cast<double>(matches.size()))
      << "a band of +-2 px in 480 lets through about one in a hundred of the swapped";
}

TEST(MatchEpipolar, UsesTheGivenKeypointsOnly) {
  const FeatureWorld world = BoxWorld(300);
  const ViewPair views(world, SE3(), At({1, 0, 0}), {}, 6);
  std::vector<int> even, third;
  for (int i = 0; i < views.a.features->size(); i += 2) even.push_back(i);
  for (int i = 0; i < views.b.features->size(); i += 3) third.push_back(i);
  const std::vector<Match> matches = MatchEpipolar(*views.a.features, even, *views.b.features,
                                                   third, views.pinhole, views.b_from_a, {});
  EXPECT_GT(matches.size(), 15u);
  for (const Match& match : matches) {
    EXPECT_EQ(match.a % 2, 0);
    EXPECT_EQ(match.b % 3, 0);
    EXPECT_TRUE(views.Right(match));
  }
  EXPECT_TRUE(MatchEpipolar(*views.a.features, {}, *views.b.features, third, views.pinhole,
                            views.b_from_a, {})
                  .empty());
  EXPECT_TRUE(MatchEpipolar(*views.a.features, even, *views.b.features, {}, views.pinhole,
                            views.b_from_a, {})
                  .empty());
}

TEST(MatchEpipolar, LeavesOutPointsNearTheEpipoleWhetherFlyingForwardsOrBackwards) {
  const FeatureWorld world = BoxWorld(3000);
  for (const double forwards : {1.0, -1.0}) {
    const ViewPair views(world, SE3(), At({0.05, 0, forwards}), {}, 7);
    const Eigen::Vector3d a_in_b = views.b_from_a.translation();
    const Eigen::Vector2d epipole = views.pinhole.Project(a_in_b);
    const auto nearest = [&](const EpipolarOptions& options) {
      double least = 1e9;
      for (const Match& match : views.Matches(options)) {
        const Keypoint& keypoint = views.b.features->keypoints[static_cast<size_t>(match.b)];
        least = std::min(least, (keypoint.px.cast<double>() - epipole).norm());
      }
      return least;
    };
    EXPECT_LT(nearest({.min_epipole_distance_px = 0}), 30) << forwards;
    EXPECT_GE(nearest({.min_epipole_distance_px = 60}), 60) << forwards;
    EXPECT_LT(nearest({.min_epipole_distance_px = 60}), 100) << forwards;
  }
}

TEST(MatchEpipolar, WithoutBaselineThereAreNoLinesToMatchAlong) {
  const FeatureWorld world = BoxWorld(300);
  const ViewPair views(world, SE3(), SE3(), {}, 8);
  EXPECT_GT(views.Shared(), 100);
  EXPECT_TRUE(views.Matches().empty());
}

TEST(EpipolarOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(EpipolarOptions().Check());
  EXPECT_THROW((EpipolarOptions{.max_distance_px = 0}.Check()), Error);
  EXPECT_THROW((EpipolarOptions{.min_similarity = 1}.Check()), Error);
  EXPECT_THROW((EpipolarOptions{.ratio = 0}.Check()), Error);
  EXPECT_THROW((EpipolarOptions{.min_epipole_distance_px = -1}.Check()), Error);
}

}  // namespace
}  // namespace deepuav
