#include "deepuav/looping/loop_verifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/map_builder.h"
#include "support/options_with.h"
#include "support/synthetic_places.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

/// A place, and a second flight that passes it 1 beside.
class LoopVerifierTest : public testing::Test {
 protected:
  LoopVerifierTest() {
    made_.AddMap();
    place_ = made_.Add(MapId{0}, FlightAlongStrip(0, 6));
  }
  Visit AddSecond(MapId map, const Sim3& map_from_world) {
    return made_.Add(map, FlightAlongStrip(1, 5, 1), map_from_world);
  }
  std::optional<LoopFinding> Verify(const Visit& visit, KeyframeId keyframe,
                                    const std::vector<KeyframeId>& places,
                                    const std::vector<Descriptors>& turned = {}) {
    std::vector<PlaceCandidate> candidates;
    for (KeyframeId id : places) candidates.push_back({place_.map, id, 0.3});
    return verifier_.Verify(made_.atlas, visit.map, keyframe, turned, candidates, &reason_);
  }
  void ExpectSimilar(const Sim3& found, const Sim3& truth, const SE3& cam_from_world) {
    EXPECT_NEAR(found.scale() / truth.scale(), 1, 0.01);
    const SE3 there = found.MovePose(cam_from_world), expected = truth.MovePose(cam_from_world);
    EXPECT_LT((there.InverseTranslation() - expected.InverseTranslation()).norm(), 0.1);
    EXPECT_LT((there * expected.Inverse()).Angle(), 0.005);
  }
  SE3 Mapped(const Visit& visit, KeyframeId id) {
    return made_.atlas.At(visit.map).At(id).cam_from_world;
  }

  const FeatureWorld world_ = StripOfGround(1);
  SyntheticVisits made_{world_, 2};
  Visit place_;
  NearestNeighbourMatcher matcher_{{}};
  Relocaliser relocaliser_{world_.camera(), {}, {}, {&matcher_}, nullptr};
  LoopVerifier verifier_{world_.world().pinhole, {}, &relocaliser_};
  std::string reason_;
};

TEST_F(LoopVerifierTest, FindsHowAnotherMapLiesWhateverItsScale) {
  for (double scale : {0.5, 0.8, 1.0, 1.4, 2.0}) {
    const Sim3 map_from_world(scale, RotationExp({0.5, -0.3, 1.0}), {10, -20, 5});
    const Visit second = AddSecond(made_.AddMap(), map_from_world);
    const KeyframeId keyframe = second.keyframes[2];
    const auto finding = Verify(second, keyframe, {place_.keyframes[3]});
    ASSERT_TRUE(finding) << scale << ": " << reason_;
    EXPECT_EQ(finding->map, second.map);
    EXPECT_EQ(finding->place_map, MapId{0});
    EXPECT_EQ(finding->tie.keyframe, keyframe);
    EXPECT_EQ(finding->tie.place, place_.keyframes[3]);
    ExpectSimilar(finding->place_from_map_world, map_from_world.Inverse(),
                  Mapped(second, keyframe));
    EXPECT_LT(PoseDifference(finding->cam_from_place_world,
                             made_.truth[static_cast<size_t>(keyframe.value)]),
              0.1);
    EXPECT_GT(finding->tie.seen.size(), 100u);
    const LoopTie truth = made_.Tie(keyframe, place_, place_.keyframes[3]);
    int right = 0;
    for (const LandmarkMatch& match : finding->tie.seen) {
      right += std::any_of(truth.seen.begin(), truth.seen.end(), [&](const LandmarkMatch& t) {
        return t.keypoint == match.keypoint && t.landmark == match.landmark;
      });
    }
    EXPECT_GE(right, static_cast<int>(finding->tie.seen.size()) * 98 / 100);
  }
}

TEST_F(LoopVerifierTest, FindsTheScaleOfAMapOfTheSameImagesByItsDepths) {
  for (const double scale : {0.5, 1.0, 3.0}) {
    const Sim3 map_from_world(scale, RotationExp({0.5, -0.3, 1.0}), {10, -20, 5});
    const Visit again = made_.Add(made_.AddMap(), FlightAlongStrip(0, 6), map_from_world);
    const KeyframeId keyframe = again.keyframes[3];
    const auto finding = Verify(again, keyframe, {place_.keyframes[3]});
    ASSERT_TRUE(finding) << scale << ": " << reason_;
    ExpectSimilar(finding->place_from_map_world, map_from_world.Inverse(), Mapped(again, keyframe));
  }
}

TEST_F(LoopVerifierTest, FindsTheDriftOfALoopInOneMap) {
  const Sim3 drift(1.2, RotationExp({0.02, 0.01, -0.05}), {3, -2, 1});
  const Visit second = AddSecond(MapId{0}, drift);
  const auto finding = Verify(second, second.keyframes[3], {place_.keyframes[4]});
  ASSERT_TRUE(finding) << reason_;
  EXPECT_EQ(finding->map, finding->place_map);
  ExpectSimilar(finding->place_from_map_world, drift.Inverse(),
                Mapped(second, second.keyframes[3]));
}

TEST_F(LoopVerifierTest, LeavesTheScaleOfMetricMapsAlone) {
  VerifierOptions options;
  options.sim3.fixed_scale = true;
  LoopVerifier verifier(world_.world().pinhole, options, &relocaliser_);
  for (const double scale : {1.004, 1.5}) {
    const Visit second =
        AddSecond(made_.AddMap(), Sim3(scale, Eigen::Quaterniond::Identity(), {3, -2, 1}));
    const auto finding = verifier.Verify(made_.atlas, second.map, second.keyframes[3], {},
                                         {{{place_.map, place_.keyframes[4], 0.3}}}, &reason_);
    ASSERT_EQ(finding.has_value(), scale < 1.1) << reason_;
    if (finding) {
      EXPECT_EQ(finding->place_from_map_world.scale(), 1);
    }
  }
}

TEST_F(LoopVerifierTest, FindsThePlaceUnderAnotherHeading) {
  const MapId other = made_.AddMap();
  std::vector<SE3> poses;
  for (int i = 0; i < 4; ++i) poses.push_back(LookDown({9 - 2.0 * i, 1, 12}, M_PI));
  const Visit second = made_.Add(other, poses);
  const KeyframeId keyframe = second.keyframes[2];
  const Features& features = made_.atlas.At(other).At(keyframe).features();
  const auto upright =
      Verify(second, keyframe, {place_.keyframes[2]}, TurnedOf(features, 2, &made_.random));
  ASSERT_TRUE(upright) << reason_;
  ExpectSimilar(upright->place_from_map_world, Sim3(), Mapped(second, keyframe));
}

TEST_F(LoopVerifierTest, RefusesOtherPlaces) {
  const Visit away = made_.Add(made_.AddMap(), FlightAlongStrip(31, 5, 0, 1));
  for (KeyframeId id : away.keyframes) {
    EXPECT_FALSE(Verify(away, id, {place_.keyframes[0], place_.keyframes[4]}));
    EXPECT_THAT(reason_, HasSubstr("no pose"));
  }
  const Visit second = AddSecond(made_.AddMap(), {});
  EXPECT_FALSE(Verify(second, second.keyframes[2], {}));
}

TEST_F(LoopVerifierTest, LandmarksThatAreOneAlreadyProveNothing) {
  // The last keyframe of the same flight sees the place's own landmarks.
  EXPECT_FALSE(Verify(place_, place_.keyframes[4], {place_.keyframes[2]}));
  EXPECT_THAT(reason_, HasSubstr("of it already"));
}

TEST_F(LoopVerifierTest, RefusesWhereTooFewLandmarksAreKnownTwice) {
  const MapId other = made_.AddMap();
  const Visit second = AddSecond(other, {});
  const KeyframeId keyframe = second.keyframes[2];
  Map& map = made_.atlas.At(other);
  const auto leave = [&](int count) {
    std::vector<LandmarkId> seen;
    for (const LandmarkMatch& match : made_.Tie(keyframe, place_, place_.keyframes[3]).seen) {
      const LandmarkId own = map.At(keyframe).landmarks[static_cast<size_t>(match.keypoint)];
      if (own.valid()) seen.push_back(own);
    }
    for (size_t i = static_cast<size_t>(count); i < seen.size(); ++i)
      map.RemoveObservation(keyframe, seen[i]);
  };
  leave(40);
  EXPECT_TRUE(Verify(second, keyframe, {place_.keyframes[3]})) << reason_;
  leave(12);
  EXPECT_FALSE(Verify(second, keyframe, {place_.keyframes[3]}));
  EXPECT_THAT(reason_, HasSubstr("landmarks are known twice"));
}

TEST_F(LoopVerifierTest, RefusesWhereTheLandmarksContradictEachOther) {
  const MapId other = made_.AddMap();
  const Visit second = AddSecond(other, {});
  Map& map = made_.atlas.At(other);
  // The pose at the place holds, but this map has its landmarks anywhere.
  for (LandmarkId id : second.landmark_of) {
    if (id.valid())
      map.SetPosition(id, map.At(id).position_world + 4 * RandomDirection(&made_.random));
  }
  EXPECT_FALSE(Verify(second, second.keyframes[2], {place_.keyframes[3]}));
  EXPECT_THAT(reason_, HasSubstr("landmarks known twice agree"));
}

TEST_F(LoopVerifierTest, StandsAThirdOfTheLandmarksFarOff) {
  const MapId other = made_.AddMap();
  const Sim3 map_from_world(1.5, RotationExp({0, 0, 1}), {1, 2, 3});
  const Visit second = AddSecond(other, map_from_world);
  Map& map = made_.atlas.At(other);
  for (LandmarkId id : second.landmark_of) {
    if (id.valid() && id.value % 3 == 0)
      map.SetPosition(id, map.At(id).position_world + 4 * RandomDirection(&made_.random));
  }
  const auto finding = Verify(second, second.keyframes[2], {place_.keyframes[3]});
  ASSERT_TRUE(finding) << reason_;
  ExpectSimilar(finding->place_from_map_world, map_from_world.Inverse(),
                Mapped(second, second.keyframes[2]));
}

TEST(VerifierOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(VerifierOptions().Check());
  EXPECT_THROW(OptionsWith(&VerifierOptions::min_pairs, 2).Check(), Error);
  EXPECT_THROW(OptionsWith(&VerifierOptions::min_pair_ratio, 1.1).Check(), Error);
  VerifierOptions inner;
  inner.sim3.rounds = 0;
  EXPECT_THROW(inner.Check(), Error);
  inner = {};
  inner.place.max_keyframes = 0;
  EXPECT_THROW(inner.Check(), Error);
}

}  // namespace
}  // namespace deepuav
