#include "deepuav/evaluation/report/map_growth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/flights.h"

namespace deepuav {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Keyframes of such ids at such seconds.
Map MapOf(const std::vector<std::pair<int64_t, double>>& keyframes) {
  Map map({0});
  for (const auto& [id, seconds] : keyframes) {
    Frame frame;
    frame.time = AtSeconds(seconds);
    frame.features = std::make_shared<const Features>();
    map.AddKeyframe({id}, frame, SE3());
  }
  return map;
}

void AddLandmarks(Map* map, const std::vector<int64_t>& created_by) {
  for (const int64_t keyframe : created_by)
    map->AddLandmark({map->LandmarkCount()}, {0, 0, 1}, {keyframe});
}

TEST(MapGrowth, OfNothingIsNothing) {
  const MapGrowth growth = GrowthOf(Map({0}));
  EXPECT_THAT(growth.times, IsEmpty());
  EXPECT_THAT(growth.landmarks, IsEmpty());
}

TEST(MapGrowth, OfOneKeyframeHasAllItsLandmarks) {
  Map map = MapOf({{4, 7.5}});
  AddLandmarks(&map, {4, 4});
  EXPECT_THAT(GrowthOf(map).times, ElementsAre(AtSeconds(7.5)));
  EXPECT_THAT(GrowthOf(map).landmarks, ElementsAre(2));
}

TEST(MapGrowth, LandmarksOfKeyframesThatAreGoneCountForTheOneBefore) {
  Map map = MapOf({{2, 10}, {5, 20}, {9, 30}});
  // Of 0, before the first that is left; of 3 and 4, after it; of 11, after the last.
  AddLandmarks(&map, {0, 3, 4, 5, 9, 11});
  EXPECT_THAT(GrowthOf(map).landmarks, ElementsAre(3, 4, 6));
}

// Flights of one map, one after the other, may have begun at the same time, or an earlier one.
TEST(MapGrowth, IsInOrderOfTimeWhateverTheOrderOfKeyframes) {
  Map map = MapOf({{0, 50}, {1, 60}, {2, 10}, {3, 60}});
  AddLandmarks(&map, {0, 1, 1, 2, 2, 2, 3});
  const MapGrowth growth = GrowthOf(map);
  EXPECT_THAT(growth.times,
              ElementsAre(AtSeconds(10), AtSeconds(50), AtSeconds(60), AtSeconds(60)));
  EXPECT_THAT(growth.landmarks, ElementsAre(3, 4, 7, 7));
}

TEST(MapGrowth, EndsWithAllLandmarksAndNeverFalls) {
  Random random(5);
  std::vector<std::pair<int64_t, double>> keyframes;
  for (int64_t id = 0; id < 40; id += 1 + random.Index(3))
    keyframes.emplace_back(id, random.Uniform(0, 100));
  Map map = MapOf(keyframes);
  std::vector<int64_t> created_by;
  for (int i = 0; i < 200; ++i) created_by.push_back(random.Index(45));
  AddLandmarks(&map, created_by);
  const MapGrowth growth = GrowthOf(map);
  ASSERT_EQ(growth.times.size(), keyframes.size());
  EXPECT_TRUE(std::is_sorted(growth.times.begin(), growth.times.end()));
  EXPECT_TRUE(std::is_sorted(growth.landmarks.begin(), growth.landmarks.end()));
  EXPECT_EQ(growth.landmarks.back(), 200);
}

}  // namespace
}  // namespace deepuav
