#include "deepuav/map/map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

constexpr int kDimension = MapBuilder::kDimension;

TEST(Map, AParentIsWhoSharesMostElseTheFallback) {
  MapBuilder builder(3, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  EXPECT_EQ(builder.map.At(b).parent, a);
  const KeyframeId c = builder.AddKeyframe();
  builder.AddLandmark({a, c}, 0);
  builder.AddLandmark({b, c}, 1);
  builder.AddLandmark({b, c}, 2);
  builder.map.ConnectToParent(c, a);
  EXPECT_EQ(builder.map.At(c).parent, b);
}

TEST(Map, RefusesASecondLandmarkAtAKeypointAndASecondKeypointOfALandmark) {
  MapBuilder builder(5, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  builder.map.ConnectToParent(b, a);
  const LandmarkId first = builder.AddLandmark({a, b}, 0);
  const LandmarkId second = builder.AddLandmark({a, b}, 1);
  EXPECT_FALSE(builder.map.AddObservation(a, 2, first));
  EXPECT_FALSE(builder.map.AddObservation(a, 1, first));
  EXPECT_EQ(builder.map.At(a).landmarks[1], second);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(builder.map));
}

TEST(Map, CovisibleByFallingShareThenId) {
  MapBuilder builder(9, 20);
  std::vector<KeyframeId> k;
  for (int i = 0; i < 5; ++i) k.push_back(builder.AddKeyframe());
  int keypoint = 0;
  const auto share = [&](KeyframeId other, int count) {
    for (int i = 0; i < count; ++i) builder.AddLandmark({k[0], other}, keypoint++);
  };
  share(k[4], 3);
  share(k[1], 1);
  share(k[3], 5);
  share(k[2], 3);
  EXPECT_EQ(builder.map.Covisible(k[0], 1, 9), (std::vector<KeyframeId>{k[3], k[2], k[4], k[1]}));
  EXPECT_EQ(builder.map.Covisible(k[0], 3, 9), (std::vector<KeyframeId>{k[3], k[2], k[4]}));
  EXPECT_EQ(builder.map.Covisible(k[0], 1, 2), (std::vector<KeyframeId>{k[3], k[2]}));
  EXPECT_TRUE(builder.map.Covisible(k[0], 6, 9).empty());
  EXPECT_TRUE(builder.map.Covisible(k[0], 1, 0).empty());
}

TEST(Map, ViewRangeIsMeanDirectionAndExtremeDistances) {
  MapBuilder builder(10, 5);
  const KeyframeId a = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {1, 0, 0}));
  const KeyframeId b = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {-1, 0, 0}));
  const KeyframeId c = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {0, 0, 3}));
  const LandmarkId id = builder.AddLandmark({a, b, c}, 0, {0, 0, 2});
  builder.map.UpdateViewRange(id);
  const Landmark& landmark = builder.map.At(id);
  EXPECT_NEAR(landmark.min_distance, std::sqrt(5), 1e-12);
  EXPECT_NEAR(landmark.max_distance, 5, 1e-12);
  EXPECT_LT((landmark.mean_view_direction - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12);
}

TEST(Map, TheRepresentativeIsTheObservationMostLikeTheOthers) {
  Random random(11);
  const std::vector<float> common = RandomDescriptor(kDimension, &random);
  Map map{MapId{0}};
  const std::vector<double> distance_from_common = {0.5, 2, 0.02, 0.6};
  map.AddLandmark({0}, {0, 0, 5}, {0});
  for (int i = 0; i < 4; ++i) {
    Features features{{KeypointAt({10, 10})}, Descriptors(kDimension)};
    features.descriptors.Append(
        NoisyDescriptor(common, distance_from_common[static_cast<size_t>(i)], &random));
    map.AddKeyframe({i}, {FrameId{i}, {}, std::make_shared<const Features>(features)}, SE3());
    map.AddObservation({i}, 0, {0});
  }
  EXPECT_EQ(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{0});
  map.UpdateAppearance({0});
  EXPECT_EQ(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{2});
  map.RemoveObservation({2}, {0});
  EXPECT_NE(map.At(LandmarkId{0}).representative.keyframe, KeyframeId{2});
}

TEST(Map, RescaleMultipliesAllLengths) {
  Random random(12);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(200, {-5, -3, 4}, {5, 3, 12}, &random);
  const FeatureWorld world(geometry, 1);
  std::vector<SE3> poses;
  for (int i = 0; i < 4; ++i) poses.push_back(Perturbed(SE3(), 0.5 * i, 0.05, &random));
  SyntheticMap made = MakeTrueMap(world, poses, {}, &random);
  made.map.RemoveKeyframe(made.keyframes[1]);
  const Map before = [&] {
    SyntheticMap copy = MakeTrueMap(world, poses, {}, &random);
    copy.map.RemoveKeyframe(copy.keyframes[1]);
    return std::move(copy.map);
  }();
  made.map.Rescale(2.5);
  for (size_t k = 0; k < poses.size(); ++k) {
    const SE3 scaled(poses[k].rotation(), 2.5 * poses[k].translation());
    EXPECT_LT(PoseDifference(made.map.PoseOf(made.keyframes[k]), scaled), 1e-9) << k;
  }
  before.landmarks().ForEach([&made](const Landmark& old) {
    const Landmark& scaled = made.map.At(old.id);
    EXPECT_LT((scaled.position_world - 2.5 * old.position_world).norm(), 1e-9);
    EXPECT_NEAR(scaled.min_distance, 2.5 * old.min_distance, 1e-9);
    EXPECT_NEAR(scaled.max_distance, 2.5 * old.max_distance, 1e-9);
    EXPECT_LT((scaled.mean_view_direction - old.mean_view_direction).norm(), 1e-12);
  });
  const KeyframeId first = made.keyframes[0];
  EXPECT_NEAR(made.map.MedianDepth(first), 2.5 * before.MedianDepth(first), 1e-9);
}

TEST(Map, MovesPixelsOfKeyPointsAndMeasurementsAndOfNobodyElse) {
  MapBuilder builder(14, 10);
  const KeyframeId a = builder.AddKeyframe(), b = builder.AddKeyframe();
  const LandmarkId landmark = builder.AddLandmark({a, b}, 3);
  builder.map.SetMeasurement(b, landmark, {{11, 12}, 0.1, true});
  builder.map.UpdateAppearance(landmark);
  const std::shared_ptr<const Features> shared = builder.map.At(a).frame.features;
  const Eigen::Vector2f before = shared->keypoints[3].px, image = shared->keypoints[3].image_px;
  builder.map.MovePixels(
      [](const Eigen::Vector2f& px) -> Eigen::Vector2f { return 2 * px + Eigen::Vector2f(1, 3); });
  const Eigen::Vector2f moved = 2 * before + Eigen::Vector2f(1, 3);
  EXPECT_EQ(builder.map.At(a).features().keypoints[3].px, moved);
  EXPECT_EQ(builder.map.At(a).features().keypoints[3].image_px, image);
  const Landmark& seen = builder.map.At(landmark);
  EXPECT_EQ(seen.observations[0].measured.px, moved);
  EXPECT_EQ(seen.observations[1].measured.px, Eigen::Vector2f(23, 27));
  const auto& representative = seen.observations[seen.representative.keyframe == a ? 0 : 1];
  EXPECT_EQ(seen.representative.measured.px, representative.measured.px);
  EXPECT_EQ(shared->keypoints[3].px, before) << "others have the features, too";
}

TEST(Map, MedianDepthOfWhatAKeyframeSees) {
  MapBuilder builder(13, 10);
  const KeyframeId a = builder.AddKeyframe(SE3(Eigen::Quaterniond::Identity(), {0, 0, 1}));
  const KeyframeId b = builder.AddKeyframe();
  EXPECT_EQ(builder.map.MedianDepth(a), 0);
  int keypoint = 0;
  for (const double depth : {3.0, 100.0, 5.0})
    builder.AddLandmark({a, b}, keypoint++, {1, 2, depth});
  EXPECT_DOUBLE_EQ(builder.map.MedianDepth(a), 6);
  EXPECT_DOUBLE_EQ(builder.map.MedianDepth(b), 5);
}

}  // namespace
}  // namespace deepuav
