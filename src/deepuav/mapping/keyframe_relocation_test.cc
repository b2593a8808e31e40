#include "deepuav/mapping/keyframe_relocation.h"

#include <gtest/gtest.h>

#include "support/straight_flight.h"

namespace deepuav {
namespace {

class KeyframeRelocationTest : public testing::Test, protected StraightFlight {
 protected:
  KeyframeRelocationTest() {
    Random random(3);
    made_ = MakeTrueMap(FeatureWorld(Ground(), 2), KeyframePoses(), {}, &random);
  }
  Map& map() { return made_.map; }
  const Keyframe& Moved() { return map().At(made_.keyframes[1]); }
  /// Its first key points with landmarks, at most `count`.
  std::vector<LandmarkMatch> SomeOf(const Keyframe& keyframe, size_t count) {
    std::vector<LandmarkMatch> some;
    for (size_t i = 0; i < keyframe.landmarks.size() && some.size() < count; ++i) {
      if (keyframe.landmarks[i].valid())
        some.push_back({static_cast<int>(i), keyframe.landmarks[i]});
    }
    return some;
  }

  SyntheticMap made_;
};

TEST_F(KeyframeRelocationTest, SeesWhatIsSaidFromWhereItIsPut) {
  auto matches = SomeOf(Moved(), 30);
  ASSERT_EQ(matches.size(), 30u);
  std::erase_if(matches, [this](const LandmarkMatch& match) {
    return map().At(match.landmark).observations.size() < 3;  // Gone before it is seen again.
  });
  ASSERT_GT(matches.size(), 10u);
  matches[0].measured = PixelMeasurement{{12, 34}, 0.1F};
  const SE3 there = LookDown({1, 2, kHeight}, 0);
  Frame frame = Moved().frame;
  frame.motion.travel = {0, 0, 0.5};
  Relocate({{Moved().id, there, frame, matches}}, &map());
  EXPECT_EQ(Moved().LandmarkCount(), static_cast<int>(matches.size()));
  for (const LandmarkMatch& match : matches)
    EXPECT_EQ(Moved().landmarks[static_cast<size_t>(match.keypoint)], match.landmark);
  EXPECT_LT((Moved().cam_from_world.translation() - there.translation()).norm(), 1e-12);
  EXPECT_EQ(Moved().motion().travel.z(), 0.5);
  const auto& observations = map().At(matches[0].landmark).observations;
  const auto own = std::ranges::find(observations, Moved().id, &Observation::keyframe);
  ASSERT_NE(own, observations.end());
  EXPECT_EQ(own->measured.px.x(), 12);
}

TEST_F(KeyframeRelocationTest, WhatOnlyMovedKeyframesSawIsRemoved) {
  const KeyframeId first = made_.keyframes[0], second = made_.keyframes[1];
  std::vector<LandmarkId> theirs, shared;
  map().landmarks().ForEach([&](const Landmark& landmark) {
    const bool is_theirs = std::ranges::all_of(landmark.observations, [&](const Observation& seen) {
      return seen.keyframe == first || seen.keyframe == second;
    });
    if (is_theirs) theirs.push_back(landmark.id);
    if (!is_theirs && landmark.observations.size() > 3) shared.push_back(landmark.id);
  });
  ASSERT_FALSE(theirs.empty());
  ASSERT_FALSE(shared.empty());
  Relocate({{first, PoseAt(0), map().At(first).frame, {}},
            {second, PoseAt(5), map().At(second).frame, {}}},
           &map());
  for (const LandmarkId id : theirs) EXPECT_FALSE(map().Contains(id)) << id.value;
  for (const LandmarkId id : shared) EXPECT_TRUE(map().Contains(id)) << id.value;
  EXPECT_EQ(map().At(first).LandmarkCount(), 0);
}

TEST_F(KeyframeRelocationTest, ALandmarkThatIsGoneIsNotSeen) {
  auto matches = SomeOf(Moved(), 5);
  matches[2].landmark = LandmarkId{100'000'000};
  Relocate({{Moved().id, Moved().cam_from_world, Moved().frame, matches}}, &map());
  EXPECT_LE(Moved().LandmarkCount(), 4);
}

}  // namespace
}  // namespace deepuav
