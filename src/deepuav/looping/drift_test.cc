#include "deepuav/looping/drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"
#include "support/map_builder.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

constexpr int kKeyframes = 21;
constexpr double kDepth = 5, kSpacing = 1;
constexpr double kDegree = std::numbers::pi / 180;

SE3 At(double x, double turn_rad = 0) {
  return SE3(RotationExp({0, turn_rad, 0}), Eigen::Vector3d::Zero()) *
         SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0));
}

/// A straight flight of 20 beside a wall 5 away, each keyframe the child of the one before.
class DriftTest : public testing::Test {
 protected:
  DriftTest() {
    for (int i = 0; i < kKeyframes; ++i) Fly(At(kSpacing * i), kSpacing * i);
  }
  /// A landmark straight ahead gives the keyframe before and this one their depth.
  void Fly(const SE3& cam_from_world, double x) {
    ids_.push_back(builder_.AddKeyframe(cam_from_world));
    if (ids_.size() < 2) return;
    const KeyframeId before = ids_[ids_.size() - 2];
    map().ConnectToParent(ids_.back(), before);
    builder_.AddLandmark({before, ids_.back()}, static_cast<int>(ids_.size()) % 2, {x, 0, kDepth});
  }
  Map& map() { return builder_.map; }
  double Travel() { return TravelBetween(map(), ids_.back(), ids_.front(), 15); }
  /// The loop that moves the last keyframe to the first.
  bool CanBe(const Sim3& place_from_map_world, std::string* reason = nullptr) {
    LoopFinding finding{map().id(), map().id(), {ids_.back(), ids_.front(), {}}, {}, {}};
    finding.place_from_map_world = place_from_map_world;
    return CanHaveDrifted(map(), finding, {}, reason);
  }
  /// About the last keyframe's camera, which stays.
  Sim3 AboutTheLast(double scale, double turn_rad) {
    const Sim3 world_from_cam(map().At(ids_.back()).cam_from_world.Inverse());
    return world_from_cam * Sim3(scale, RotationExp({0, turn_rad, 0}), {0, 0, 0}) *
           world_from_cam.Inverse();
  }

  MapBuilder builder_{1, 100};
  std::vector<KeyframeId> ids_;
};

Sim3 Shift(double x) { return Sim3(SE3(Eigen::Quaterniond::Identity(), {x, 0, 0})); }

TEST_F(DriftTest, TravelIsTheWayBetweenCameras) { EXPECT_NEAR(Travel(), 20, 1e-9); }

TEST_F(DriftTest, ATurnCountsAsTheWayThatReplacesAsMuch) {
  const double before = Travel();
  const double x = kSpacing * (kKeyframes - 1);
  Fly(At(x, 30 * kDegree), x);
  const double depth = kDepth * std::cos(30 * kDegree);
  EXPECT_NEAR(Travel() - before, 30 * kDegree * depth, 1e-9);
}

TEST_F(DriftTest, TravelIsShortWhereTheMapKnowsThePlaceAlready) {
  map().AddLoop(ids_.back(), ids_[2]);
  EXPECT_NEAR(Travel(), 2 + 18, 1e-9) << "a tie is as long as the map says";
  for (int keypoint = 10; keypoint < 25; ++keypoint)
    builder_.AddLandmark({ids_[4], ids_.back()}, keypoint, {10, 0, kDepth});
  map().SetPose(ids_.back(), At(4.5));
  EXPECT_NEAR(Travel(), 4.5, 1e-9);
}

TEST_F(DriftTest, AFewLandmarksInCommonHoldNothingTogether) {
  for (int keypoint = 10; keypoint < 24; ++keypoint)
    builder_.AddLandmark({ids_.front(), ids_.back()}, keypoint, {10, 0, kDepth});
  map().SetPose(ids_.back(), At(2));
  EXPECT_NEAR(Travel(), 19 + 17, 1e-9);
}

TEST_F(DriftTest, ThereIsNoTravelToWhatIsNotConnected) {
  ids_.push_back(builder_.AddKeyframe(At(40)));
  EXPECT_TRUE(std::isinf(Travel()));
}

TEST_F(DriftTest, DriftsByATenthOfTheWay) {
  EXPECT_TRUE(CanBe(Sim3()));
  EXPECT_TRUE(CanBe(Shift(1.9)));
  EXPECT_TRUE(CanBe(Shift(-1.9)));
  EXPECT_FALSE(CanBe(Shift(2.1)));
}

TEST_F(DriftTest, APosterThatComesAgainIsNoLoop) {
  std::string reason;
  EXPECT_FALSE(CanBe(Shift(-20), &reason));
  EXPECT_EQ(reason,
            "the map cannot have drifted by 20 of 20 travelled (4 views), a scale of 1.000 and "
            "0.0 degrees");
}

TEST_F(DriftTest, ScaleAndDirectionDriftAsViewsAreReplaced) {
  EXPECT_TRUE(CanBe(AboutTheLast(std::exp(0.27), 0)));
  EXPECT_TRUE(CanBe(AboutTheLast(std::exp(-0.27), 0)));
  EXPECT_FALSE(CanBe(AboutTheLast(std::exp(0.29), 0)));
  EXPECT_FALSE(CanBe(AboutTheLast(std::exp(-0.29), 0)));
  EXPECT_TRUE(CanBe(AboutTheLast(1, 15.5 * kDegree)));
  EXPECT_FALSE(CanBe(AboutTheLast(1, -16.5 * kDegree)));
}

TEST_F(DriftTest, WhatScaleAndTurnExplainIsNoDriftOfPosition) {
  EXPECT_FALSE(CanBe(Shift(3)));
  EXPECT_TRUE(CanBe(Shift(3) * AboutTheLast(std::exp(0.1), 0)));
  EXPECT_TRUE(CanBe(Shift(3) * AboutTheLast(1, 6 * kDegree)));
}

TEST(DriftOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(DriftOptions().Check());
  EXPECT_THROW(OptionsWith(&DriftOptions::min_shared, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&DriftOptions::per_travel, 0.).Check(), Error);
  EXPECT_THROW(OptionsWith(&DriftOptions::least_scale, -1.).Check(), Error);
  EXPECT_THROW(OptionsWith(&DriftOptions::scale_per_view, -1.).Check(), Error);
  EXPECT_THROW(OptionsWith(&DriftOptions::least_turn_deg, 0.).Check(), Error);
  EXPECT_THROW(OptionsWith(&DriftOptions::turn_per_view_deg, -1.).Check(), Error);
}

}  // namespace
}  // namespace deepuav
