#include "deepuav/mapping/mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "deepuav/base/error.h"
#include "deepuav/mapping/testing/mapper_fixture.h"
#include "support/options_with.h"
#include "support/path_error.h"

namespace deepuav {
namespace {

TEST_F(MapperTest, StartsAMapWithTheMedianDepthAsUnit) {
  const auto local_map = Start();
  ASSERT_TRUE(local_map);
  EXPECT_EQ(map().KeyframeCount(), 2);
  EXPECT_NEAR(map().MedianDepth({0}), 1, 1e-9);
  EXPECT_EQ(map().At(KeyframeId{0}).cam_from_world.Matrix(), Eigen::Matrix4d::Identity());
  EXPECT_EQ(map().At(KeyframeId{1}).parent, KeyframeId{0});
  EXPECT_EQ(local_map->keyframes[static_cast<size_t>(local_map->centre)].id, KeyframeId{1});
  EXPECT_GT(map().LandmarkCount(), 150);
  EXPECT_EQ(static_cast<int>(local_map->landmarks.size()), map().LandmarkCount());
  const SE3 truth = Truth(1) * Truth(0).Inverse();
  EXPECT_NEAR(map().At(KeyframeId{1}).cam_from_world.translation().norm(),
              truth.translation().norm() / depth_, 0.05 * truth.translation().norm() / depth_);
}

TEST_F(MapperTest, StartsNoMapFromViewsThatContradictOneAnother) {
  InitialMapRequest request = FirstViews(0, 1);
  for (auto& point : request.points) point.position_first.z() *= -1;
  EXPECT_FALSE(mapper_.StartMap(request));
  request.points.clear();
  EXPECT_FALSE(mapper_.StartMap(request));
  EXPECT_TRUE(atlas_.Remaining().empty());
  EXPECT_TRUE(Start()) << "it goes on after that";
}

TEST_F(MapperTest, AFlightStaysNearTheTruth) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  for (int frame = 2; frame < 22; ++frame) {
    local_map = mapper_.InsertKeyframe(Request(frame, *local_map));
    ASSERT_TRUE(local_map);
    const KeyframeId newest = local_map->keyframes[static_cast<size_t>(local_map->centre)].id;
    ASSERT_EQ(map().At(newest).frame.id, FrameId{frame});
    ASSERT_GT(map().At(newest).LandmarkCount(), 60) << frame;
  }
  EXPECT_GT(map().KeyframeCount(), 5);
  const auto path_error = [this] {
    std::vector<Eigen::Vector3d> estimate, truth;
    map().keyframes().ForEach([&](const Keyframe& keyframe) {
      estimate.push_back(keyframe.cam_from_world.InverseTranslation());
      truth.push_back(Truth(static_cast<int>(keyframe.frame.id.value)).InverseTranslation());
    });
    return RmseAfterAlignment(estimate, truth);
  };
  EXPECT_LT(path_error(), 0.1) << "over a path of 34 m";
  Pinhole pinhole = world_.camera().pinhole;
  mapper_.AdjustGlobally(map().id(), &pinhole, false);
  EXPECT_LT(path_error(), 0.05);

  int wrong = 0, observations = 0;
  map().landmarks().ForEach([&](const Landmark& landmark) {
    std::map<int, int> shown;
    for (const Observation& o : landmark.observations) {
      const auto frame = static_cast<size_t>(map().At(o.keyframe).frame.id.value);
      ++shown[views_[frame].landmark[static_cast<size_t>(o.keypoint)]];
      ++observations;
    }
    int most = 0;
    for (const auto& entry : shown) most = std::max(most, entry.second);
    wrong += static_cast<int>(landmark.observations.size()) - most;
  });
  EXPECT_LT(wrong, observations / 200);
}

TEST_F(MapperTest, TakesARequestWhoseReferenceAndLandmarksAreGone) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  KeyframeRequest late = Request(4, *local_map);
  for (int frame = 3; frame < 9; ++frame)
    local_map = mapper_.InsertKeyframe(Request(3, *local_map));
  late.matches.push_back({0, {999'999}});
  late.views.push_back({{999'999}, 3, 3});
  const auto after = mapper_.InsertKeyframe(late);
  ASSERT_TRUE(after);
  EXPECT_GT(after->landmarks.size(), 50u);
}

TEST_F(MapperTest, KeepsMapsApart) {
  ASSERT_TRUE(Start());
  const int landmarks = map().LandmarkCount();
  const auto second = mapper_.StartMap(FirstViews(20, 22));
  ASSERT_TRUE(second);
  EXPECT_EQ(second->map, MapId{1});
  EXPECT_EQ(atlas_.Remaining().size(), 2u);
  EXPECT_EQ(atlas_.At(MapId{0}).LandmarkCount(), landmarks);
  atlas_.At(MapId{1}).keyframes().ForEach([this](const Keyframe& keyframe) {
    EXPECT_FALSE(atlas_.At(MapId{0}).Contains(keyframe.id)) << "ids are unique over all maps";
  });
}

TEST_F(MapperTest, AStartOfWhichLittleIsLeftIsNone) {
  InitialMapRequest request = FirstViews(0, 1);
  ASSERT_GT(request.points.size(), 50u);
  const std::vector<InitialMapRequest::Point> right = request.points;
  for (size_t i = 0; 10 * i < 7 * right.size(); ++i)
    request.points[i].keypoint_second = right[(i + 17) % right.size()].keypoint_second;
  std::map<int, int> uses;
  std::erase_if(request.points,
                [&](const auto& point) { return uses[point.keypoint_second]++ > 0; });
  EXPECT_FALSE(mapper_.StartMap(request));
  EXPECT_TRUE(atlas_.Remaining().empty());
}

TEST(MappingOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(MappingOptions().Check());
  EXPECT_THROW(OptionsWith(&MappingOptions::min_found_ratio, 1.5).Check(), Error);
  EXPECT_THROW(OptionsWith(&MappingOptions::young_keyframes, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&MappingOptions::window_keyframes, 1).Check(), Error);
  MappingOptions inner;
  inner.creation.epipolar.ratio = 0;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
