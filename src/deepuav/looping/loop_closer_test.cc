#include "deepuav/looping/loop_closer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "deepuav/base/error.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/map_builder.h"
#include "support/options_with.h"
#include "support/synthetic_places.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

using Corrections = std::vector<std::optional<MapCorrection>>;

Sim3 Shift(double x, double y) {
  return Sim3(SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, y, 0)));
}

/// A flight over a strip that is known, and others that come to it again.
class LoopCloserTest : public testing::Test {
 protected:
  LoopCloserTest() : drift_(1.1, RotationExp({0.01, 0.02, -0.05}), {2, -1, 0.5}) {
    made_.AddMap();
    first_ = made_.Add(MapId{0}, FlightAlongStrip(0, 8));
  }
  Visit Again(MapId map, const Sim3& map_from_world, double x = 1, int keyframes = 12) {
    return made_.Add(map, FlightAlongStrip(x, keyframes, 0.5, 1), map_from_world);
  }
  void Begin(const LoopingOptions& options = {}) {
    vocabulary_.emplace(VocabularyOf(made_.views));
    places_.emplace(&*vocabulary_, options.recogniser);
    closer_.emplace(world_.camera(), options, LocatorOptions{}, &*places_, PlaceMatchers{&matcher_},
                    nullptr);
    for (KeyframeId id : first_.keyframes) places_->Remember(made_.atlas.At(MapId{0}).At(id));
  }
  std::optional<MapCorrection> Process(const Visit& visit, size_t k) {
    auto correction = closer_->Process(made_.atlas, visit.map, visit.keyframes[k], {});
    places_->Remember(made_.atlas.At(visit.map).At(visit.keyframes[k]));
    return correction;
  }
  /// Of keyframes `from` up to `to`, the correction each gave.
  std::vector<bool> Closes(const Visit& visit, size_t from, size_t to) {
    std::vector<bool> closes;
    for (size_t k = from; k < to; ++k) closes.push_back(Process(visit, k).has_value());
    return closes;
  }
  static std::vector<bool> OnlyLastOf(size_t count) {
    std::vector<bool> closes(count, false);
    closes.back() = true;
    return closes;
  }
  static std::vector<bool> NoneOf(size_t count) { return std::vector<bool>(count, false); }

  const FeatureWorld world_ = StripOfGround(1);
  SyntheticVisits made_{world_, 2};
  const Sim3 drift_;
  Visit first_;
  NearestNeighbourMatcher matcher_{{}};
  std::optional<Vocabulary> vocabulary_;
  std::optional<PlaceMemory> places_;
  std::optional<LoopCloser> closer_;
};

TEST_F(LoopCloserTest, ThreeKeyframesThatAgreeCloseALoop) {
  const Visit second = Again(MapId{0}, drift_);
  Begin();
  EXPECT_EQ(Closes(second, 0, 2), NoneOf(2));
  const auto correction = Process(second, 2);
  ASSERT_TRUE(correction);
  EXPECT_FALSE(correction->merges());
  EXPECT_EQ(correction->map, MapId{0});
  ASSERT_EQ(correction->ties.size(), 3u);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(correction->ties[k].keyframe, second.keyframes[k]);
    EXPECT_LT(correction->ties[k].place, second.keyframes[0]);
    EXPECT_GT(correction->ties[k].seen.size(), 100u);
  }
  const Map& map = made_.atlas.At(MapId{0});
  ASSERT_EQ(static_cast<int>(correction->keyframes.size()), map.KeyframeCount());
  for (const KeyframeMove& move : correction->keyframes) {
    const SE3 moved = move.new_from_old.MovePose(map.At(move.keyframe).cam_from_world);
    const SE3& truth = made_.truth[static_cast<size_t>(move.keyframe.value)];
    if (move.keyframe == map.root()) {
      EXPECT_EQ(moved.Matrix(), truth.Matrix()) << "the root stays";
    } else if (move.keyframe >= second.keyframes[0]) {
      EXPECT_LT((moved.InverseTranslation() - truth.InverseTranslation()).norm(), 0.6)
          << move.keyframe.value << ", of a drift of 2.3";
    }
  }
}

TEST_F(LoopCloserTest, ClosesNoLoopThatTheMapCannotHaveDriftedBy) {
  const Visit copy = Again(MapId{0}, Shift(24, 0));
  Begin();
  EXPECT_EQ(Closes(copy, 0, 6), NoneOf(6));
}

TEST_F(LoopCloserTest, RestsAfterALoopAndThenAsksForThreeAgain) {
  const Visit second = Again(MapId{0}, drift_);
  Begin();
  EXPECT_EQ(Closes(second, 0, 3), OnlyLastOf(3));
  EXPECT_EQ(Closes(second, 3, 11), OnlyLastOf(5 + 3));
}

/// Two flights at either side of the first that hardly see each other's ground.
class LoopCloserOfTwoTest : public LoopCloserTest {
 protected:
  std::vector<bool> ClosesWithDrifts(const Sim3& left, const Sim3& right) {
    const Visit a = made_.Add(MapId{0}, FlightAlongStrip(0, 3, 5, 1), left);
    const Visit b = made_.Add(MapId{0}, FlightAlongStrip(11, 3, -5, 1), right);
    LoopingOptions options = OptionsWith(&LoopingOptions::agreeing_keyframes, 2);
    options.drift.per_travel = 1;
    Begin(options);
    return {Process(a, 1).has_value(), Process(b, 1).has_value()};
  }
};

TEST_F(LoopCloserOfTwoTest, KeyframesThatAgreeCloseALoop) {
  EXPECT_EQ(ClosesWithDrifts(Shift(3, 0), Shift(3.1, 0.1)), OnlyLastOf(2));
}

TEST_F(LoopCloserOfTwoTest, KeyframesThatDisagreeCloseNone) {
  EXPECT_EQ(ClosesWithDrifts(Shift(3, 0), Shift(-3, 2)), NoneOf(2));
}

TEST_F(LoopCloserOfTwoTest, KeyframesThatDisagreeByAUnitCloseNone) {
  EXPECT_EQ(ClosesWithDrifts(Shift(3, 0), Shift(4, 0)), NoneOf(2)) << "37 px";
}

TEST_F(LoopCloserTest, CountsFindingsOfTheNewestTenKeyframes) {
  const Visit away = Again(MapId{0}, {}, 31, 7), second = Again(MapId{0}, drift_);
  Begin();
  EXPECT_EQ(Closes(second, 0, 2), NoneOf(2));
  EXPECT_EQ(Closes(away, 0, 7), NoneOf(7));
  EXPECT_EQ(Closes(second, 2, 3), OnlyLastOf(1));
}

TEST_F(LoopCloserTest, ForgetsFindingsOfTheEleventhLast) {
  const Visit away = Again(MapId{0}, {}, 31, 8), second = Again(MapId{0}, drift_);
  Begin();
  EXPECT_EQ(Closes(second, 0, 2), NoneOf(2));
  EXPECT_EQ(Closes(away, 0, 8), NoneOf(8));
  EXPECT_EQ(Closes(second, 2, 3), NoneOf(1));
}

TEST_F(LoopCloserTest, ForgetsFindingsOfCulledKeyframes) {
  const Visit second = Again(MapId{0}, drift_);
  Begin();
  EXPECT_EQ(Closes(second, 0, 2), NoneOf(2));
  made_.atlas.At(MapId{0}).RemoveKeyframe(second.keyframes[0]);
  EXPECT_EQ(Closes(second, 2, 3), NoneOf(1));
  const auto correction = Process(second, 3);
  ASSERT_TRUE(correction);
  EXPECT_EQ(correction->ties.front().keyframe, second.keyframes[1]);
  for (const KeyframeMove& move : correction->keyframes)
    EXPECT_TRUE(made_.atlas.At(MapId{0}).Contains(move.keyframe));
}

TEST_F(LoopCloserTest, ForgetsFindingsOfMapsThatWereMergedMeanwhile) {
  const MapId third = made_.AddMap(), newest = made_.AddMap();
  made_.Add(third, FlightAlongStrip(31, 2));
  const Visit second = Again(newest, drift_);
  Begin();
  EXPECT_EQ(Closes(second, 0, 2), NoneOf(2));
  made_.atlas.Merge(MapId{0}, third, made_.atlas.At(third).root());
  EXPECT_EQ(Closes(second, 2, 4), NoneOf(2));
  const auto correction = Process(second, 4);
  ASSERT_TRUE(correction);
  EXPECT_EQ(correction->into, third);
  EXPECT_EQ(correction->ties.size(), 3u);
}

TEST_F(LoopCloserTest, JoinsAMapOfAnyScale) {
  const Sim3 map_from_world(2.5, RotationExp({0.3, 1, -0.5}), {5, 6, 7});
  const Visit second = Again(made_.AddMap(), map_from_world);
  Begin();
  EXPECT_EQ(Closes(second, 0, 2), NoneOf(2));
  const auto correction = Process(second, 2);
  ASSERT_TRUE(correction);
  EXPECT_TRUE(correction->merges());
  EXPECT_EQ(correction->map, second.map);
  EXPECT_EQ(correction->into, MapId{0});
  EXPECT_TRUE(correction->keyframes.empty());
  EXPECT_EQ(correction->ties.size(), 3u);
  for (KeyframeId id : second.keyframes) {
    const SE3 moved =
        correction->into_from_map.MovePose(made_.atlas.At(second.map).At(id).cam_from_world);
    const SE3& truth = made_.truth[static_cast<size_t>(id.value)];
    EXPECT_LT((moved.InverseTranslation() - truth.InverseTranslation()).norm(), 0.3) << id.value;
  }
}

TEST_F(LoopCloserTest, AsksForTheHeadingsThatItsMapHasSeenPlacesUnder) {
  Begin();
  const MapId map = first_.map;
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, map, first_.keyframes[4]), QuarterTurns{});
  const Visit ahead = made_.Add(map, FlightAlongStrip(31, 2));
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, map, ahead.keyframes[0]), QuarterTurns{});
  const Visit back = made_.Add(map, {LookDown({31, 0.5, 12}, M_PI)});
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, map, back.keyframes[0]),
            (QuarterTurns{false, true, false}));
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, map, first_.keyframes[4]),
            (QuarterTurns{false, true, false}));
}

TEST_F(LoopCloserTest, AsksForNoHeadingsOfItsSurroundings) {
  SyntheticVisits turning(world_, 2);
  const Visit on_the_spot = turning.Add(
      turning.AddMap(),
      {LookDown({5, 0, 12}, 0), LookDown({5.5, 0, 12}, M_PI / 2), LookDown({5, 0, 12}, M_PI)});
  Begin();
  for (const KeyframeId id : on_the_spot.keyframes)
    EXPECT_EQ(closer_->TurnsFor(turning.atlas, on_the_spot.map, id), QuarterTurns{}) << id.value;
}

TEST_F(LoopCloserTest, AsksForNoHeadingsWhileItRests) {
  const Visit second = Again(MapId{0}, drift_);
  made_.Add(MapId{0}, {LookDown({31, 0.5, 12}, M_PI)});
  Begin();
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, MapId{0}, second.keyframes[2]),
            (QuarterTurns{false, true, false}));
  EXPECT_EQ(Closes(second, 0, 3), OnlyLastOf(3));
  for (size_t k = 3; k < 8; ++k) {
    EXPECT_EQ(closer_->TurnsFor(made_.atlas, MapId{0}, second.keyframes[k]), QuarterTurns{}) << k;
    Process(second, k);
  }
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, MapId{0}, second.keyframes[8]),
            (QuarterTurns{false, true, false}));
}

TEST_F(LoopCloserTest, AsksForAllHeadingsWhereThereIsAnotherMap) {
  Begin();
  const MapId other = made_.AddMap();
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, first_.map, first_.keyframes[4]), QuarterTurns{})
      << "an empty one";
  const Visit beside = made_.Add(other, FlightAlongStrip(0, 2));
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, first_.map, first_.keyframes[4]), kAllTurns);
  EXPECT_EQ(closer_->TurnsFor(made_.atlas, other, beside.keyframes[0]), kAllTurns);
}

TEST_F(LoopCloserTest, TellsPlacesLikeAFrameUnderAnyHeading) {
  Begin();
  const SyntheticView view =
      world_.View(LookDown({6.2, 0.5, 12}, 0), {0.5, 0.3, 0, 20}, &made_.random);
  const auto upright = places_->PlacesLike(made_.atlas, *view.features, {});
  ASSERT_FALSE(upright.empty());
  EXPECT_EQ(upright[0].keyframe, first_.keyframes[3]);
  const SyntheticView strange = Redescribed(view, &made_.random);
  const auto turned = places_->PlacesLike(made_.atlas, *strange.features,
                                          TurnedOf(*view.features, 2, &made_.random));
  ASSERT_FALSE(turned.empty());
  EXPECT_EQ(turned[0].keyframe, first_.keyframes[3]);
  EXPECT_EQ(turned[0].similarity, upright[0].similarity);

  std::vector<Descriptors> one_heading(3);
  one_heading[1] = view.features->descriptors;
  const auto told = places_->PlacesLike(made_.atlas, *strange.features, one_heading);
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told[0].keyframe, first_.keyframes[3]);
  EXPECT_EQ(told[0].view, 2);
}

TEST(LoopingOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(LoopingOptions().Check());
  EXPECT_THROW(OptionsWith(&LoopingOptions::agreeing_keyframes, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LoopingOptions::memory_keyframes, 2).Check(), Error);
  EXPECT_THROW(OptionsWith(&LoopingOptions::max_disagreement_px, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LoopingOptions::max_scale_disagreement, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LoopingOptions::rest_keyframes, -1).Check(), Error);
  EXPECT_THROW(OptionsWith(&LoopingOptions::moved_keyframes, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&LoopingOptions::min_near_shared, 0).Check(), Error);
  LoopingOptions inner;
  inner.verifier.min_pairs = 0;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
