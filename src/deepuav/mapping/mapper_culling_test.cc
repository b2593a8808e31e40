#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "deepuav/mapping/testing/mapper_fixture.h"
#include "support/options_with.h"

namespace deepuav {
namespace {

TEST_F(MapperTest, CullsKeyframesWhoseLandmarksOthersSeeAndKnowsTheirPoses) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  // Hovering: all frames see the same.
  for (int frame = 3; frame < 12; ++frame) {
    KeyframeRequest request = Request(3, *local_map);
    request.frame.id = FrameId{3};
    local_map = mapper_.InsertKeyframe(request);
  }
  EXPECT_LT(map().KeyframeCount(), 8);
  EXPECT_TRUE(map().Contains(KeyframeId{0})) << "the root stays";
  for (int64_t id = 2; id < 11; ++id) {
    const SE3 difference = map().PoseOf(KeyframeId{id}) * map().PoseOf(KeyframeId{2}).Inverse();
    EXPECT_LT(difference.translation().norm(), 0.01) << id;
  }
}

TEST_F(MapperTest, CullsYoungLandmarksThatAreNotFoundAgain) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  KeyframeRequest request = Request(3, *local_map);
  // Half of them were never where they should be.
  std::vector<LandmarkId> never_found;
  for (ViewCount& view : request.views) {
    if (view.landmark.value % 2 == 0) continue;
    view = {view.landmark, 10, 1};
    never_found.push_back(view.landmark);
  }
  ASSERT_GT(never_found.size(), 50u);
  mapper_.InsertKeyframe(request);
  for (LandmarkId id : never_found) EXPECT_FALSE(map().Current(id)) << id.value;
  EXPECT_GT(map().LandmarkCount(), 50);
}

/// Culling a keyframe takes observations of landmarks that have proved themselves.
class MapperThatKeepsAllKeyframesTest : public MapperTest {
 protected:
  MapperThatKeepsAllKeyframesTest()
      : MapperTest(OptionsWith(&MappingOptions::redundant_ratio, 2)) {}
};

TEST_F(MapperThatKeepsAllKeyframesTest, CullsLandmarksThatTooFewSeeOnceTheyAreNotYoung) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  for (int frame = 2; frame < 15; ++frame) {
    local_map = mapper_.InsertKeyframe(Request(frame, *local_map));
  }
  EXPECT_EQ(map().KeyframeCount(), 15);
  int old = 0, thin = 0;
  map().landmarks().ForEach([&](const Landmark& landmark) {
    if (14 - landmark.created_by.value < options_.young_keyframes) return;
    ++old;
    // An outlier may have been taken from it since.
    thin += static_cast<int>(landmark.observations.size()) < options_.min_young_observations;
  });
  EXPECT_GT(old, 100);
  EXPECT_LT(thin, old / 20);
}

TEST_F(MapperTest, CullsTheYoungOfAMapThatGoesOnAfterAnother) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  std::vector<LandmarkId> young;
  atlas_.At(MapId{0}).landmarks().ForEach([&](const Landmark& l) { young.push_back(l.id); });
  for (LandmarkId id : young) atlas_.At(MapId{0}).CountViews(id, 100, 0);
  ASSERT_TRUE(mapper_.StartMap(FirstViews(20, 22)));
  const auto kept = [&] {
    return std::count_if(young.begin(), young.end(),
                         [&](LandmarkId id) { return atlas_.At(MapId{0}).Contains(id); });
  };
  EXPECT_EQ(kept(), static_cast<long>(young.size())) << "of the other map";
  KeyframeRequest request = Request(2, *local_map);
  request.views.clear();
  mapper_.InsertKeyframe(request);
  EXPECT_LT(kept(), static_cast<long>(young.size()) / 10) << "hardly ever found again";
}

TEST_F(MapperTest, YoungLandmarksAgeByKeyframesOfTheirOwnMap) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  std::vector<LandmarkId> young;
  atlas_.At(MapId{0}).landmarks().ForEach([&](const Landmark& l) { young.push_back(l.id); });
  ASSERT_TRUE(mapper_.StartMap(FirstViews(20, 22)));
  KeyframeRequest request = Request(2, *local_map);
  request.matches.resize(request.matches.size() / 2);
  request.views.resize(request.matches.size());
  mapper_.InsertKeyframe(request);
  const Map& first = atlas_.At(MapId{0});
  int seen_twice = 0;
  for (LandmarkId id : young) {
    ASSERT_TRUE(first.Contains(id) || first.Current(id)) << "one keyframe later";
    const auto current = first.Current(id);
    seen_twice += current && first.At(*current).observations.size() == 2;
  }
  EXPECT_GT(seen_twice, 10);
}

TEST_F(MapperTest, LandmarksOfALoadedMapAreStillYoung) {
  auto local_map = Start();
  ASSERT_TRUE(local_map);
  std::vector<LandmarkId> young;
  map().landmarks().ForEach([&](const Landmark& l) { young.push_back(l.id); });
  for (LandmarkId id : young) atlas_.At(MapId{0}).CountViews(id, 100, 0);
  Mapper later(world_.camera(), options_, &atlas_, nullptr);
  later.Resume();
  KeyframeRequest request = Request(2, *local_map);
  request.views.clear();
  later.InsertKeyframe(request);
  const auto kept =
      std::count_if(young.begin(), young.end(), [&](LandmarkId id) { return map().Contains(id); });
  EXPECT_LT(kept, static_cast<long>(young.size()) / 10) << "hardly ever found again";
}

}  // namespace
}  // namespace deepuav
