#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "deepuav/tracking/testing/tracker_fixture.h"

namespace deepuav {
namespace {

TEST_F(TrackerTest, MovesWithTheMap) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(0, At({1.9, 0, 0})).pose);
  ASSERT_TRUE(Track(1, At({2.0, 0, 0})).pose);
  const SE3 old_from_new = SE3(RotationExp({0.1, 0.4, -0.2}), {30, -20, 10});
  Map& map = made_->map;
  std::vector<LandmarkId> landmarks;
  map.landmarks().ForEach([&](const Landmark& l) { landmarks.push_back(l.id); });
  for (KeyframeId id : made_->keyframes) map.SetPose(id, map.At(id).cam_from_world * old_from_new);
  for (LandmarkId id : landmarks) {
    map.SetPosition(id, old_from_new.Inverse() * map.At(id).position_world);
    map.UpdateViewRange(id);
  }
  tracker_.UseLocalMap(MakeLocalMap(map, made_->keyframes[5], {}));
  const SE3 truth = At({2.1, 0, 0}) * old_from_new;
  const TrackingResult result = Track(2, At({2.1, 0, 0}));
  ASSERT_TRUE(result.pose) << result.reason;
  EXPECT_LT(CentreError(PoseOf(result), truth), 0.02);
}

TEST_F(TrackerTest, FollowsItsKeyframeIntoAnotherMap) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(1, At({2, 0, 0})).pose);
  auto merged = std::make_shared<LocalMap>(*local_map_);
  merged->map = MapId{7};
  tracker_.UseLocalMap(merged);
  const TrackingResult result = Track(2, At({2, 0, 0}));
  ASSERT_TRUE(result.pose);
  EXPECT_EQ(result.pose->map, merged->map);
}

TEST_F(TrackerTest, ScalesItsMotionWithTheMap) {
  const double growth = 3;
  tracker_.Begin(local_map_);
  for (int64_t i = 1; i <= 3; ++i) ASSERT_TRUE(Track(i, At({0.2 * double(i), 0, 0})).pose);
  auto grown = std::make_shared<LocalMap>(*local_map_);
  const auto scaled = [growth](const SE3& pose) {
    return SE3(pose.rotation(), growth * pose.translation());
  };
  for (LocalKeyframe& keyframe : grown->keyframes) {
    keyframe.cam_from_world = scaled(keyframe.cam_from_world);
    keyframe.scale = growth;
  }
  for (LocalLandmark& landmark : grown->landmarks) {
    landmark.position_world *= growth;
    landmark.min_distance *= growth;
    landmark.max_distance *= growth;
  }
  tracker_.UseLocalMap(grown);
  const TrackingResult result = Track(4, At({0.8, 0, 0}));
  ASSERT_TRUE(result.pose);
  const AnchoredPose& pose = result.pose->anchored;
  EXPECT_EQ(pose.keyframe_scale, growth);
  const SE3 expected = scaled(At({0.8, 0, 0}));
  const SE3 found = pose.cam_from_keyframe * scaled(made_->map.At(pose.keyframe).cam_from_world);
  EXPECT_LT((found.InverseTranslation() - expected.InverseTranslation()).norm(), 0.1);
}

TEST_F(TrackerTest, GoesOnInAnotherMapThatLostItsKeyframe) {
  tracker_.Begin(local_map_);
  ASSERT_TRUE(Track(1, At({2, 0, 0})).pose);
  ASSERT_TRUE(Track(2, At({2.1, 0, 0})).pose);
  const SE3 moved = SE3::Exp((Vector6d() << 30, -20, 5, 0.4, 1, -2).finished());
  auto other = std::make_shared<LocalMap>(*local_map_);
  other->map = MapId{7};
  for (LocalKeyframe& keyframe : other->keyframes) {
    keyframe.id.value += 1000;
    keyframe.cam_from_world = keyframe.cam_from_world * moved.Inverse();
  }
  for (LocalLandmark& landmark : other->landmarks) {
    landmark.position_world = moved * landmark.position_world;
    landmark.mean_view_direction = moved.rotation() * landmark.mean_view_direction;
  }
  tracker_.UseLocalMap(other);
  const TrackingResult result = Track(3, At({2.2, 0, 0}));
  ASSERT_TRUE(result.pose);
  EXPECT_EQ(result.pose->map, MapId{7});
}

}  // namespace
}  // namespace deepuav
