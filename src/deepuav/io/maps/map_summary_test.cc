#include "deepuav/io/maps/map_summary.h"

#include <gtest/gtest.h>

#include "deepuav/io/maps/map_export.h"
#include "deepuav/io/testing/map_test_support.h"

namespace deepuav {
namespace {

Frame FrameOf(int keypoints, Timestamp time) {
  Features features{{}, Descriptors(2)};
  for (int i = 0; i < keypoints; ++i) {
    features.keypoints.push_back({{0, 0}, {0, 0}, 0.5f, 1.0f});
    features.descriptors.Append(std::vector<float>{1, 0});
  }
  return {FrameId{0}, time, std::make_shared<const Features>(std::move(features))};
}

SE3 CameraAt(const Eigen::Vector3d& position) {
  return SE3(Eigen::Quaterniond::Identity(), -position);
}

/// Keyframes at x = 1, 5, 2 by id and at the times 100, 300, 200.
Map SmallMap() {
  Map map(MapId{0});
  const double positions[] = {1, 5, 2};
  const int64_t times[] = {100, 300, 200};
  for (int i = 0; i < 3; ++i) {
    map.AddKeyframe(KeyframeId{i}, FrameOf(4 + i, {times[i]}),
                    CameraAt({positions[i], 0, -1.0 * i}));
    if (i > 0) map.ConnectToParent(KeyframeId{i}, KeyframeId{0});
  }
  const auto add_landmark = [&](int id, const Eigen::Vector3d& position, int views) {
    map.AddLandmark(LandmarkId{id}, position, KeyframeId{0});
    for (int i = 0; i < views; ++i) map.AddObservation(KeyframeId{i}, id, LandmarkId{id});
  };
  add_landmark(0, {1, 2, 3}, 2);
  add_landmark(1, {-1, 4, 3}, 3);
  add_landmark(2, {0, 0, 9}, 3);
  add_landmark(3, {0, 0, 8}, 2);
  return map;
}

TEST(MapSummary, CountsAndMeasures) {
  const MapSummary summary = SummariseMap(SmallMap());
  EXPECT_EQ(summary.keyframes, 3);
  EXPECT_EQ(summary.landmarks, 4);
  EXPECT_EQ(summary.removed_keyframes, 0);
  EXPECT_EQ(summary.keypoints, 4 + 5 + 6);
  EXPECT_EQ(summary.observations, 10);
  EXPECT_EQ(summary.median_observations, 2.5);
  EXPECT_EQ(summary.descriptor_dimension, 2);
  EXPECT_EQ(summary.first_time, Timestamp{100});
  EXPECT_EQ(summary.last_time, Timestamp{300});
  EXPECT_DOUBLE_EQ(summary.path_length, std::sqrt(1 + 4) + std::sqrt(9 + 1));
  EXPECT_EQ(summary.cameras.min(), Eigen::Vector3d(1, 0, -2));
  EXPECT_EQ(summary.cameras.max(), Eigen::Vector3d(5, 0, 0));
  EXPECT_EQ(summary.points.min(), Eigen::Vector3d(-1, 0, 3));
  EXPECT_EQ(summary.points.max(), Eigen::Vector3d(1, 4, 9));
}

TEST(MapSummary, OddMedianAndRemovedKeyframes) {
  Map map = SmallMap();
  map.RemoveLandmark(LandmarkId{3});
  EXPECT_EQ(SummariseMap(map).median_observations, 3);
  map.RemoveKeyframe(KeyframeId{2});
  const MapSummary summary = SummariseMap(map);
  EXPECT_EQ(summary.keyframes, 2);
  EXPECT_EQ(summary.removed_keyframes, 1);
  EXPECT_EQ(summary.median_observations, 2);
}

TEST(MapSummary, OfAnEmptyMap) {
  const MapSummary summary = SummariseMap(Map(MapId{0}));
  EXPECT_EQ(summary.keyframes, 0);
  EXPECT_EQ(summary.median_observations, 0);
  EXPECT_EQ(summary.path_length, 0);
  EXPECT_TRUE(summary.cameras.isEmpty());
  EXPECT_TRUE(summary.points.isEmpty());
}

TEST(MapExport, KeyframesComeByTime) {
  const Trajectory trajectory = KeyframeTrajectory(SmallMap());
  ASSERT_EQ(trajectory.size(), 3u);
  const double expected_x[] = {1, 2, 5};
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(trajectory[i].time.nanoseconds, 100 * static_cast<int64_t>(i + 1));
    EXPECT_EQ(trajectory[i].world_from_cam.translation().x(), expected_x[i]);
  }
}

/// However many: a sort's buffer may lie anywhere, and poses want theirs aligned.
TEST(MapExport, KeyframesOfMapsOfAnySizeComeByTime) {
  for (int count = 1; count < 100; ++count) {
    Map map(MapId{0});
    for (int i = 0; i < count; ++i)
      map.AddKeyframe(KeyframeId{i}, FrameOf(1, {count - i}), CameraAt({1.0 * i, 0, 0}));
    const Trajectory trajectory = KeyframeTrajectory(map);
    ASSERT_EQ(trajectory.size(), static_cast<size_t>(count));
    for (int i = 0; i < count; ++i)
      EXPECT_EQ(trajectory[i].world_from_cam.translation().x(), count - 1 - i);
  }
}

TEST(MapExport, PointsAreTheLandmarks) {
  const std::vector<ColouredPoint> points = LandmarkPoints(SmallMap());
  ASSERT_EQ(points.size(), 4u);
  EXPECT_EQ(points[1].position, Eigen::Vector3d(-1, 4, 3));
  EXPECT_EQ(points[1].rgb, (std::array<uint8_t, 3>{180, 180, 180})) << "no image is kept";
}

TEST(MapExport, PointsHaveTheGreyOfTheirImages) {
  const auto grey_with = [](float x, float y) {
    Features features;
    features.keypoints = {{{x, y}, {x, y}, 1, 1}};
    features.descriptors = Descriptors(1);
    features.descriptors.Append(std::vector<float>{1});
    GreyImage image(5, 9, uint8_t{50});
    image(2, 7) = 200;
    Map map(MapId{0});
    map.AddKeyframe(KeyframeId{0},
                    {FrameId{0}, Timestamp{0}, std::make_shared<const Features>(features),
                     std::make_shared<const ImagePyramid>(image, 1)},
                    SE3());
    map.AddLandmark(LandmarkId{0}, {0, 0, 1}, KeyframeId{0});
    map.AddObservation(KeyframeId{0}, 0, LandmarkId{0});
    return LandmarkPoints(map).front().rgb[0];
  };
  EXPECT_EQ(grey_with(7.4f, 1.6f), 200);
  EXPECT_EQ(grey_with(6.4f, 1.6f), 50);
  EXPECT_EQ(grey_with(9.2f, 1.6f), 180) << "past the image's edge";
}

}  // namespace
}  // namespace deepuav
