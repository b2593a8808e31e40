#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/map/map.h"
#include "deepuav/map/map_state.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

constexpr int kKeypoints = 4;

Keyframe MakeKeyframe(int64_t id, int64_t parent) {
  Features features{{}, Descriptors(2)};
  for (int k = 0; k < kKeypoints; ++k) {
    features.keypoints.push_back({{1, 2}, {3, 4}, 0.5f, 1});
    features.descriptors.Append(std::vector<float>{1, 0});
  }
  Keyframe keyframe;
  keyframe.id = {id};
  keyframe.frame = {{id}, {id}, std::make_shared<const Features>(std::move(features))};
  keyframe.parent = {parent};
  return keyframe;
}

Landmark MakeLandmark(int64_t id, const std::vector<Observation>& observations) {
  Landmark landmark;
  landmark.id = {id};
  landmark.observations = observations;
  if (!observations.empty()) landmark.representative = observations.back();
  return landmark;
}

/// Keyframes 1 <- 3 <- 4 and a loop of 1 and 4, keyframe 2 removed; landmarks 0 and 5; 1 merged
/// into 2 into 5.
MapState ValidState() {
  MapState state;
  state.id = {0};
  state.keyframes = {MakeKeyframe(1, -1), MakeKeyframe(3, 1), MakeKeyframe(4, 3)};
  state.landmarks = {MakeLandmark(0, {{{1}, 0}, {{3}, 1}, {{4}, 2}}),
                     MakeLandmark(5, {{{1}, 1}, {{3}, 0}})};
  state.culled[{2}] = {{{1}, SE3()}};
  state.merged_into = {{{1}, {2}}, {{2}, {5}}};
  state.keyframes[0].loops = {{4}};
  state.keyframes[2].loops = {{1}};
  state.keyframes[1].scale = 2.5;
  return state;
}

TEST(MapRestoreTest, DerivesWhatFollows) {
  const Map map = Map::Restore(ValidState());
  EXPECT_EQ(map.KeyframeCount(), 3);
  EXPECT_EQ(map.LandmarkCount(), 2);
  const Keyframe& first = map.At(KeyframeId{1});
  EXPECT_EQ(first.landmarks, (std::vector<LandmarkId>{{0}, {5}, {}, {}}));
  EXPECT_EQ(first.covisible, (std::map<KeyframeId, int>{{{3}, 2}, {{4}, 1}}));
  EXPECT_EQ(first.children, std::set<KeyframeId>{{3}});
  EXPECT_EQ(map.At(KeyframeId{4}).covisible, (std::map<KeyframeId, int>{{{1}, 1}, {{3}, 1}}));
  EXPECT_EQ(map.Remaining({2}), KeyframeId{1});
  EXPECT_EQ(map.Current({1}), LandmarkId{5});
  EXPECT_EQ(map.root(), KeyframeId{1});
  EXPECT_EQ(map.At(KeyframeId{4}).loops, std::set<KeyframeId>{{1}});
  EXPECT_EQ(map.At(KeyframeId{3}).scale, 2.5);
}

TEST(MapRestoreTest, TakesAMapWithoutKeyframes) {
  const Map map = Map::Restore({});
  EXPECT_EQ(map.KeyframeCount(), 0);
  EXPECT_FALSE(map.root().valid());
}

TEST(MapRestoreTest, DoesNotTrustWhatItDerives) {
  MapState state = ValidState();
  state.keyframes[0].landmarks = {{99}};
  state.keyframes[0].covisible[{77}] = 5;
  state.keyframes[0].children = {{77}};
  const Map map = Map::Restore(std::move(state));
  EXPECT_EQ(map.At(KeyframeId{1}).landmarks.size(), size_t{kKeypoints});
  EXPECT_FALSE(map.At(KeyframeId{1}).covisible.contains({77}));
  EXPECT_EQ(map.At(KeyframeId{1}).children, std::set<KeyframeId>{{3}});
}

struct Contradiction {
  const char* expected;
  std::function<void(MapState*)> make;
};

TEST(MapRestoreTest, RefusesContradictions) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Contradiction> contradictions = {
      {"keyframe 3 follows 4", [](MapState* s) { std::swap(s->keyframes[1], s->keyframes[2]); }},
      {"keyframe 1 follows 1", [](MapState* s) { s->keyframes[1].id = {1}; }},
      {"keyframe -1 follows -1", [](MapState* s) { s->keyframes[0].id = {}; }},
      {"keyframe 3 has no frame", [](MapState* s) { s->keyframes[1].frame.features.reset(); }},
      {"keyframe 3 has no frame", [](MapState* s) { s->keyframes[1].frame.id = {}; }},
      {"keyframe 4 has no pose",
       [&](MapState* s) {
         s->keyframes[2].cam_from_world = SE3::FromUnit({1, 0, 0, 0}, {0, nan, 0});
       }},
      {"keyframe 4 has no pose",
       [](MapState* s) {
         s->keyframes[2].cam_from_world = SE3::FromUnit({1, 1, 0, 0}, {0, 0, 0});
       }},
      {"keyframe 4 has 1 key points and 0 descriptors",
       [](MapState* s) {
         s->keyframes[2].frame.features = std::make_shared<const Features>(
             Features{{{{1, 2}, {3, 4}, 0.5f, 1}}, Descriptors(2)});
       }},
      {"of dimension 3: expected as many, of dimension 2",
       [](MapState* s) {
         s->keyframes[2].frame.features =
             std::make_shared<const Features>(Features{{}, Descriptors(3)});
       }},
      {"keyframe 4 has a key point",
       [](MapState* s) {
         Features features = s->keyframes[2].features();
         features.keypoints[1].sigma_px = 0;
         s->keyframes[2].frame.features = std::make_shared<const Features>(std::move(features));
       }},
      {"keyframe 3 has the scale 0", [](MapState* s) { s->keyframes[1].scale = 0; }},
      {"keyframe 3 has the scale -1", [](MapState* s) { s->keyframes[1].scale = -1; }},
      {"keyframe 3 has the scale nan", [&](MapState* s) { s->keyframes[1].scale = nan; }},
      {"keyframe 3 has the scale inf",
       [](MapState* s) { s->keyframes[1].scale = std::numeric_limits<double>::infinity(); }},
      {"keyframe 2 has the scale 0", [](MapState* s) { s->culled[{2}].scale = 0; }},
      {"keyframe 2 has the scale nan",
       [&](MapState* s) { s->culled[{2}].pose.keyframe_scale = nan; }},
      {"keyframe 1 closes a loop with 4", [](MapState* s) { s->keyframes[2].loops.clear(); }},
      {"keyframe 1 closes a loop with 2", [](MapState* s) { s->keyframes[0].loops.insert({2}); }},
      {"keyframe 3 closes a loop with 3", [](MapState* s) { s->keyframes[1].loops.insert({3}); }},
      {"keyframes 1 and 3 have no parent", [](MapState* s) { s->keyframes[1].parent = {}; }},
      {"keyframe 4 has the parent 2", [](MapState* s) { s->keyframes[2].parent = {2}; }},
      {"own ancestor", [](MapState* s) { s->keyframes[0].parent = {4}; }},
      {"own ancestor", [](MapState* s) { s->keyframes[1].parent = {3}; }},
      {"keyframe 3 was removed and is there",
       [](MapState* s) {
         s->culled[{3}] = {{{1}, SE3()}};
       }},
      {"removed keyframe 2 hangs on 7", [](MapState* s) { s->culled[{2}].pose.keyframe = {7}; }},
      {"hangs on itself", [](MapState* s) { s->culled[{2}].pose.keyframe = {2}; }},
      {"landmark 0 was merged", [](MapState* s) { s->merged_into[{0}] = {5}; }},
      {"merged into itself", [](MapState* s) { s->merged_into[{2}] = {1}; }},
      {"landmark 5 follows 5", [](MapState* s) { s->landmarks[0].id = {5}; }},
      {"landmark 0 has values", [&](MapState* s) { s->landmarks[0].position_world.y() = nan; }},
      {"landmark 0 has values", [&](MapState* s) { s->landmarks[0].max_distance = nan; }},
      {"landmark 5 was found -1 times", [](MapState* s) { s->landmarks[1].found = -1; }},
      {"represented by key point 3",
       [](MapState* s) { s->landmarks[1].representative.keypoint = 3; }},
      {"represented by key point 0 of keyframe -1",
       [](MapState* s) { s->landmarks[1].representative = {}; }},
      {"at key point 0 of keyframe 1",
       [](MapState* s) {
         s->landmarks[1] = MakeLandmark(5, {{{1}, 0}, {{3}, 0}});
       }},
      {"at key point 4 of keyframe 1",
       [](MapState* s) {
         s->landmarks[1] = MakeLandmark(5, {{{1}, kKeypoints}});
       }},
      {"at key point -1 of keyframe 1",
       [](MapState* s) {
         s->landmarks[1] = MakeLandmark(5, {{{1}, -1}});
       }},
      {"at key point 0 of keyframe 2",
       [](MapState* s) {
         s->landmarks[1] = MakeLandmark(5, {{{2}, 0}});
       }},
      {"by rising keyframe",
       [](MapState* s) {
         s->landmarks[1] = MakeLandmark(5, {{{3}, 0}, {{1}, 1}});
       }},
      {"by rising keyframe",
       [](MapState* s) {
         s->landmarks[1] = MakeLandmark(5, {{{3}, 0}, {{3}, 2}});
       }},
  };
  for (const Contradiction& contradiction : contradictions) {
    MapState state = ValidState();
    contradiction.make(&state);
    try {
      Map::Restore(std::move(state));
      ADD_FAILURE() << "accepted: " << contradiction.expected;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(contradiction.expected));
    }
  }
}

}  // namespace
}  // namespace deepuav
