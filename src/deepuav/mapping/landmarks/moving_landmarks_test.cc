#include "deepuav/mapping/landmarks/moving_landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

SE3 At(double x) { return SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0)); }

/// A flight along a wall ten units away, all of whose landmarks patches have measured.
class MovingLandmarksTest : public testing::Test {
 protected:
  MovingLandmarksTest() {
    Random random(3);
    std::vector<SE3> poses;
    for (int i = 0; i < 10; ++i) poses.push_back(At(0.8 * i));
    made_ = MakeTrueMap(world_, poses, {0.3, 0.3, 0, 0}, &random);
    for (const LandmarkId id : All()) MeasureByPatch(id, true);
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(500, {-8, -4, 9.8}, {16, 4, 10.2}, &random);
    return FeatureWorld(geometry, 2);
  }
  Map& map() { return made_.map; }
  std::vector<LandmarkId> All() const {
    std::vector<LandmarkId> ids;
    made_.map.landmarks().ForEach([&ids](const Landmark& l) { ids.push_back(l.id); });
    return ids;
  }
  void MeasureByPatch(LandmarkId id, bool by_patch) {
    const std::vector<Observation> observations = map().At(id).observations;
    for (const Observation& o : observations) {
      PixelMeasurement measured = o.measured;
      measured.by_patch = by_patch;
      map().SetMeasurement(o.keyframe, id, measured);
    }
  }
  /// A landmark that so many keyframes see, at least.
  LandmarkId SeenBy(size_t keyframes) {
    for (const LandmarkId id : All()) {
      if (map().At(id).observations.size() >= keyframes) return id;
    }
    return {};
  }
  void KeepObservations(LandmarkId id, size_t count) {
    while (map().At(id).observations.size() > count)
      map().RemoveObservation(map().At(id).observations.back().keyframe, id);
  }
  /// Away from the camera in the middle of those that see it, on the same ray.
  void PutAtDepth(LandmarkId id, double factor) {
    const std::vector<Observation>& seen = map().At(id).observations;
    const Eigen::Vector3d centre =
        map().At(seen[seen.size() / 2].keyframe).cam_from_world.InverseTranslation();
    map().SetPosition(id, centre + factor * (map().At(id).position_world - centre));
  }
  int Judge() { return RemoveMoving(&map(), options_, hovering_); }

  const FeatureWorld world_ = MakeWorld();
  SyntheticMap made_;
  MovingLandmarkOptions options_;
  HoveringOptions hovering_;
};

TEST_F(MovingLandmarksTest, KeepsWhatStands) {
  const size_t before = All().size();
  ASSERT_GT(before, 200u);
  EXPECT_EQ(Judge(), 0);
  EXPECT_EQ(All().size(), before);
}

TEST_F(MovingLandmarksTest, FewViewsThatNoPatchConfirmsAreNotEnough) {
  const LandmarkId few = SeenBy(6), many = [&] {
    const std::vector<LandmarkId> ids = All();
    return *std::find_if(ids.rbegin(), ids.rend(),
                         [&](LandmarkId id) { return map().At(id).observations.size() >= 6; });
  }();
  ASSERT_NE(few, many);
  KeepObservations(few, 3);
  for (const LandmarkId id : {few, many}) {
    MeasureByPatch(id, false);
    map().CountViews(id, 10, 9);
  }
  EXPECT_EQ(Judge(), 1);
  EXPECT_FALSE(map().Contains(few));
  EXPECT_TRUE(map().Contains(many));
  map().CountViews(many, 50, 0);  // gone from where it was
  EXPECT_EQ(Judge(), 1);
  EXPECT_FALSE(map().Contains(many));
}

TEST_F(MovingLandmarksTest, WhereNoPatchesAreTheirAbsenceTellsNothing) {
  for (const LandmarkId id : All()) {
    MeasureByPatch(id, false);
    map().CountViews(id, 50, 1);
  }
  EXPECT_EQ(Judge(), 0);
}

TEST_F(MovingLandmarksTest, FewViewsOfAnotherDepthThanAllAroundAreNotEnough) {
  hovering_.distrust = false;
  for (const double factor : {0.5, 1.1, 2.0}) {
    const LandmarkId id = SeenBy(5);
    PutAtDepth(id, factor);
    EXPECT_EQ(Judge(), 0) << factor;  // five views do not agree by chance
    KeepObservations(id, 2);
    const bool is_near = factor == 1.1;
    EXPECT_EQ(Judge(), is_near ? 0 : 1) << factor;
    EXPECT_EQ(map().Contains(id), is_near);
  }
}

TEST_F(MovingLandmarksTest, WhatHoversAboveTheGroundTakesMoreViews) {
  const LandmarkId id = SeenBy(7);
  PutAtDepth(id, 0.3);
  EXPECT_EQ(Judge(), 0);  // a mast stays in view
  KeepObservations(id, 6);
  hovering_.distrust = false;
  EXPECT_EQ(Judge(), 0);
  hovering_.distrust = true;
  EXPECT_EQ(Judge(), 1);
  EXPECT_FALSE(map().Contains(id));
}

TEST_F(MovingLandmarksTest, OptionsOutOfRangeAreRefused) {
  options_.max_depth_step = 0;
  EXPECT_THROW(options_.Check(), Error);
  options_ = {};
  options_.min_found_ratio = 1.5;
  EXPECT_THROW(options_.Check(), Error);
}

TEST_F(MovingLandmarksTest, WhatLiesInAPartOfTheImageIsTakenAway) {
  ImageRegion left(world_.camera().width, world_.camera().height, 8);
  const auto in_left_half = [&](const Eigen::Vector2f& px) {
    return px.x() < static_cast<float>(world_.camera().width) / 2;
  };
  const auto observations = [&](bool of_left) {
    int count = 0;
    map().keyframes().ForEach([&](const Keyframe& keyframe) {
      for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
        if (keyframe.landmarks[i].valid())
          count += left.Covers(keyframe.features().keypoints[i].image_px) == of_left;
      }
    });
    return count;
  };
  map().keyframes().ForEach([&](const Keyframe& keyframe) {
    for (const Keypoint& k : keyframe.features().keypoints) {
      if (in_left_half(k.image_px)) left.Add(left.CellOf(k.image_px));
    }
  });
  const int landmarks = map().LandmarkCount(), right = observations(false);
  ASSERT_GT(observations(true), 100);
  RemoveObservationsIn(left, &map());
  EXPECT_EQ(observations(true), 0);
  EXPECT_GT(observations(false), right * 3 / 4) << "but of landmarks that one view is left of";
  EXPECT_LT(map().LandmarkCount(), landmarks);
  EXPECT_GT(map().LandmarkCount(), 0);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map()));
}

}  // namespace
}  // namespace deepuav
