#include "deepuav/survey/growth/map_link.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

/// Two maps of one place, of which the second is turned, moved and larger: views 0 to 2 are of the
/// first alone, 3 and 4 of the second alone, and 2 of both. Every third point is of the first and
/// seen by view 3, the next of the second and seen by view 0, the next of the second and seen by
/// view 2.
class MapLinkTest : public ::testing::Test {
 protected:
  explicit MapLinkTest(int points = 90) : point_count_(points) {
    lens_.camera.pinhole = {500, 500, 319.5, 239.5};
    Random random(1);
    for (int v = 0; v < 5; ++v)
      poses_.push_back(Perturbed(LookDown({3.0 * v, v % 2 * 2.0, 20}, 0), 0.2, 0.05, &random));
    px_.resize(poses_.size());
    tracks_.of_keypoint.resize(poses_.size());
    for (int t = 0; t < point_count_; ++t) {
      points_.emplace_back(random.Uniform(0, 10), random.Uniform(-4, 5), random.Uniform(0, 3));
      const size_t seen_by = t % 3 == 0 ? 3 : t % 3 == 1 ? 0 : 2;
      const Eigen::Vector2d noise(random.Gaussian(0.3), random.Gaussian(0.3));
      tracks_.tracks.push_back(
          {{{static_cast<int>(seen_by), static_cast<int>(px_[seen_by].size())}}});
      px_[seen_by].push_back(
          {lens_.camera.pinhole.Project(poses_[seen_by] * points_.back()) + noise});
      if (t % 3 == 0) continue;
      tracks_.tracks.back().sights.push_back({4, static_cast<int>(px_[4].size())});
      px_[4].push_back({lens_.camera.pinhole.Project(poses_[4] * points_.back())});
    }
  }

  SurveyState Main() const {
    SurveyState main(tracks_, poses_.size(), lens_);
    for (const size_t v : {0, 1, 2}) main.cam_from_world[v] = poses_[v];
    for (size_t t = 0; t < points_.size(); t += 3) main.points[t] = points_[t];
    return main;
  }

  /// The pose of view 2 there is off by as much as one from few points.
  SurveyState Side(bool has_common) const {
    const Sim3 side_from_main = main_from_side_.Inverse();
    SurveyState side(tracks_, poses_.size(), lens_);
    for (const size_t v : {3, 4}) side.cam_from_world[v] = side_from_main.MovePose(poses_[v]);
    Random random(2);
    if (has_common)
      side.cam_from_world[2] = Perturbed(side_from_main.MovePose(poses_[2]), 0.1, 0.005, &random);
    for (size_t t = 0; t < points_.size(); ++t) {
      if (t % 3 != 0) side.points[t] = side_from_main * points_[t];
    }
    return side;
  }

  std::optional<MapLink> Find(bool has_common) const {
    return FindMapLink(tracks_, px_, Main(), Side(has_common), {3, 4}, 3);
  }

  const int point_count_;
  const Sim3 main_from_side_{
      0.3,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
      {5, -2, 1}};
  SurveyLens lens_;
  std::vector<SE3> poses_;
  std::vector<Eigen::Vector3d> points_;
  Tracks tracks_;
  ViewPixels px_;
};

TEST_F(MapLinkTest, IsFoundByWhatEachSeesOfTheOther) {
  const auto link = Find(true);
  ASSERT_TRUE(link);
  EXPECT_EQ(link->sights, point_count_ * 2 / 3) << "what the common view sees tells no scale";
  EXPECT_EQ(link->agreeing, point_count_ * 2 / 3);
  EXPECT_NEAR(link->main_from_side.scale() / main_from_side_.scale(), 1, 5 * link->scale_sigma);
  EXPECT_LT(link->scale_sigma, 0.02);
  EXPECT_LT(link->main_from_side.rotation().angularDistance(main_from_side_.rotation()), 0.005);
}

TEST_F(MapLinkTest, WrongMatchesChangeNothing) {
  Random random(3);
  for (size_t v : {0, 2, 3}) {
    for (size_t k = 0; k < px_[v].size(); k += 3)
      px_[v][k].px = {random.Uniform(0, 640), random.Uniform(0, 480)};
  }
  const auto link = Find(true);
  ASSERT_TRUE(link);
  EXPECT_NEAR(link->agreeing, point_count_ * 4 / 9, 2);
  EXPECT_NEAR(link->main_from_side.scale() / main_from_side_.scale(), 1, 5 * link->scale_sigma);
}

/// As of a map made with wrong matches, or of two cameras.
class LargeMapLinkTest : public MapLinkTest {
 protected:
  LargeMapLinkTest() : MapLinkTest(9000) {}
};

TEST_F(LargeMapLinkTest, IsFoundInSecondsAmongThousandsOfWrongMatches) {
  Random random(4);
  for (size_t v : {0, 2, 3}) {
    for (size_t k = 0; k < px_[v].size(); ++k) {
      if (k % 10 != 0) px_[v][k].px = {random.Uniform(0, 640), random.Uniform(0, 480)};
    }
  }
  const auto link = Find(true);
  ASSERT_TRUE(link);
  EXPECT_NEAR(link->agreeing, point_count_ / 15, 20);
  EXPECT_NEAR(link->main_from_side.scale() / main_from_side_.scale(), 1, 5 * link->scale_sigma);
}

TEST_F(MapLinkTest, NeedsAPhotographThatBothKnow) { EXPECT_FALSE(Find(false)); }

TEST_F(MapLinkTest, WhatNoPhotographOutsideShowsDoesNotCount) {
  for (size_t t = 1; t < points_.size(); t += 3) tracks_.tracks[t].sights.pop_back();
  const auto link = Find(true);
  ASSERT_TRUE(link);
  EXPECT_EQ(link->sights, point_count_ / 3);
}

TEST_F(MapLinkTest, OfOneViewOfPointsTheScaleIsNotTold) {
  for (size_t t = 0; t < points_.size(); ++t) {
    if (t % 3 != 2) tracks_.tracks[t].sights.clear();
  }
  EXPECT_FALSE(Find(true)) << "all sights are those that the common view is held by";
}

}  // namespace
}  // namespace deepuav
