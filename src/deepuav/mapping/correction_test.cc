#include "deepuav/mapping/correction.h"

#include <gtest/gtest.h>

#include "deepuav/mapping/mapper.h"
#include "support/map_builder.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

const PatchObserver kKeyPointsOnly(Camera{}, PatchOptions{.enabled = false}, {});

/// Of landmarks that several of the map stand for, by what its observations show.
int Duplicates(const SyntheticVisits& made, const Map& map) {
  std::map<int, std::set<LandmarkId>> by_landmark;
  map.landmarks().ForEach([&](const Landmark& landmark) {
    for (const Observation& o : landmark.observations) {
      const auto& shown = made.views[static_cast<size_t>(o.keyframe.value)].landmark;
      by_landmark[shown[static_cast<size_t>(o.keypoint)]].insert(landmark.id);
    }
  });
  return static_cast<int>(std::count_if(by_landmark.begin(), by_landmark.end(),
                                        [](const auto& entry) { return entry.second.size() > 1; }));
}

/// Two passages over the same ground; the second drifted.
class CorrectionTest : public testing::Test {
 protected:
  CorrectionTest() : drift_(1.15, RotationExp({0.01, -0.02, 0.03}), {1.5, -0.8, 0.4}) {
    made_.AddMap();
    first_ = made_.Add(MapId{0}, FlightAlongStrip(0, 6));
  }
  Visit AddSecond(MapId map) { return made_.Add(map, FlightAlongStrip(1, 5, 0.5), drift_); }
  double PoseError(KeyframeId id) const {
    return PoseDifference(made_.atlas.At(MapId{0}).PoseOf(id),
                          made_.truth[static_cast<size_t>(id.value)]);
  }
  double WorstPoseError() const {
    double worst = 0;
    for (size_t k = 0; k < made_.truth.size(); ++k)
      worst = std::max(worst, PoseError({static_cast<int64_t>(k)}));
    return worst;
  }
  std::vector<KeyframeMove> MovesBack(const Visit& visit) const {
    std::vector<KeyframeMove> moves;
    for (KeyframeId id : visit.keyframes) moves.push_back({id, drift_.Inverse()});
    return moves;
  }

  const FeatureWorld world_ = StripOfGround(1);
  SyntheticVisits made_{world_, 2};
  const Sim3 drift_;
  Visit first_;
};

TEST_F(CorrectionTest, LandmarksMoveWithTheKeyframeTheyLookLike) {
  const Visit second = AddSecond(MapId{0});
  Map& map = made_.atlas.At(MapId{0});
  const KeyframeId culled = second.keyframes[2];
  map.RemoveKeyframe(culled);
  std::vector<KeyframeMove> moves = MovesBack(second);
  std::erase_if(moves, [&](const KeyframeMove& move) { return move.keyframe == culled; });
  MoveKeyframes(moves, &map);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map));
  EXPECT_LT(WorstPoseError(), 1e-9) << "that of the culled one as well";
  int checked = 0;
  for (const Visit& visit : {first_, second}) {
    for (size_t i = 0; i < visit.landmark_of.size(); ++i) {
      const LandmarkId id = visit.landmark_of[i];
      if (!id.valid() || !map.Contains(id)) continue;
      const Landmark moved = map.At(id);
      ASSERT_LT((moved.position_world - world_.landmarks()[i]).norm(), 1e-9);
      map.UpdateViewRange(id);
      ASSERT_EQ(map.At(id).mean_view_direction, moved.mean_view_direction) << "is up to date";
      ASSERT_EQ(map.At(id).max_distance, moved.max_distance);
      ++checked;
    }
  }
  EXPECT_GT(checked, 500);
  for (KeyframeId id : first_.keyframes) EXPECT_EQ(map.At(id).scale, 1);
  EXPECT_NEAR(map.At(second.keyframes[0]).scale, 1 / 1.15, 1e-12);
}

TEST_F(CorrectionTest, FusingATieGivesTheKeyframeThePlacesLandmarks) {
  const Visit second = AddSecond(MapId{0});
  Map& map = made_.atlas.At(MapId{0});
  MoveKeyframes(MovesBack(second), &map);
  const KeyframeId keyframe = second.keyframes[3], place = first_.keyframes[3];
  LoopTie tie = made_.Tie(keyframe, first_, place);
  ASSERT_GT(tie.seen.size(), 100u);
  // Since it was found, landmarks went, were merged, and one keyframe of the place was culled.
  map.RemoveLandmark(tie.seen[0].landmark);
  map.MergeLandmark(tie.seen[1].landmark, tie.seen[2].landmark);
  const LandmarkId fused = tie.seen[2].landmark;
  tie.seen.push_back({tie.seen[5].keypoint, {999'999}});
  map.RemoveKeyframe(first_.keyframes[4]);
  const int before = Duplicates(made_, map);
  FuseTie(tie, kKeyPointsOnly, &map);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map));
  EXPECT_EQ(map.At(keyframe).loops, std::set<KeyframeId>{place});
  int fused_count = 0;
  for (size_t i = 3; i + 1 < tie.seen.size(); ++i) {
    if (!map.Contains(tie.seen[i].landmark)) continue;  // Only the culled one and another saw it.
    ++fused_count;
    EXPECT_EQ(map.At(keyframe).landmarks[static_cast<size_t>(tie.seen[i].keypoint)],
              tie.seen[i].landmark);
  }
  EXPECT_GT(fused_count, 100);
  EXPECT_TRUE(map.Contains(fused));
  EXPECT_EQ(map.At(keyframe).landmarks[static_cast<size_t>(tie.seen[1].keypoint)], fused)
      << "the first that comes gets it; a keyframe sees a landmark once";
  EXPECT_LT(Duplicates(made_, map), before - 100);
  EXPECT_GT(map.At(keyframe).covisible.at(place), 100);

  const int landmarks = map.LandmarkCount();
  FuseTie(tie, kKeyPointsOnly, &map);  // Here and there are one now.
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map));
  EXPECT_EQ(map.LandmarkCount(), landmarks);
}

TEST_F(CorrectionTest, AMergedMapLiesWhereThePlaceSaysAndHangsOnIt) {
  const MapId other = made_.AddMap();
  const Visit second = AddSecond(other);
  Map& map = made_.atlas.At(other);
  map.RemoveKeyframe(second.keyframes[1]);
  const int keyframes = map.KeyframeCount() + made_.atlas.At(MapId{0}).KeyframeCount();
  MapCorrection correction{other, MapId{0}, drift_.Inverse(), {}, {}};
  ASSERT_TRUE(correction.merges());
  correction.ties = {made_.Tie(second.keyframes[2], first_, first_.keyframes[2]),
                     made_.Tie(second.keyframes[3], first_, first_.keyframes[3])};
  MergeMaps(correction, &made_.atlas);
  EXPECT_EQ(made_.atlas.Remaining(), std::vector<MapId>{{0}});
  const Map& merged = made_.atlas.At(other);
  EXPECT_EQ(merged.id(), MapId{0});
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(merged));
  EXPECT_EQ(merged.KeyframeCount(), keyframes);
  EXPECT_EQ(merged.root(), first_.keyframes[0]);
  EXPECT_EQ(merged.At(second.keyframes[3]).parent, first_.keyframes[3]);
  EXPECT_LT(WorstPoseError(), 1e-9);
  for (size_t i = 0; i < second.landmark_of.size(); ++i) {
    if (!merged.Current(second.landmark_of[i])) continue;
    ASSERT_LT((merged.At(second.landmark_of[i]).position_world - world_.landmarks()[i]).norm(),
              1e-9);
  }
}

TEST_F(CorrectionTest, TheOlderMapStaysWhereItIs) {
  const MapId other = made_.AddMap();
  const Visit second = AddSecond(other);
  const SE3 before = made_.atlas.At(MapId{0}).At(first_.keyframes[2]).cam_from_world;
  MapCorrection correction{MapId{0}, other, drift_, {}, {}};
  LoopTie tie = made_.Tie(first_.keyframes[2], second, second.keyframes[2]);
  correction.ties = {tie};
  MergeMaps(correction, &made_.atlas);
  EXPECT_EQ(made_.atlas.Remaining(), std::vector<MapId>{{0}});
  const Map& merged = made_.atlas.At(other);
  EXPECT_EQ(merged.id(), MapId{0});
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(merged));
  EXPECT_EQ(merged.root(), first_.keyframes[0]);
  EXPECT_EQ(merged.At(second.keyframes[2]).parent, first_.keyframes[2]);
  EXPECT_EQ(merged.At(first_.keyframes[2]).cam_from_world.Matrix(), before.Matrix());
  EXPECT_LT(WorstPoseError(), 1e-9);
}

/// What the Mapper makes of a correction that is not quite right.
class ApplyTest : public CorrectionTest {
 protected:
  Sim3 Nearly(const Sim3& right) {
    return Sim3(Perturbed(SE3(), 0.05, 0.002, &made_.random), 1.005) * right;
  }

  Mapper mapper_{world_.camera(), {}, &made_.atlas, nullptr};
};

TEST_F(ApplyTest, ALoopBecomesOneMapOfOnePlace) {
  const Visit second = AddSecond(MapId{0});
  MapCorrection correction{MapId{0}, MapId{0}, {}, MovesBack(second), {}};
  for (KeyframeMove& move : correction.keyframes) move.new_from_old = Nearly(move.new_from_old);
  for (size_t k : {2u, 3u, 4u})
    correction.ties.push_back(made_.Tie(second.keyframes[k], first_, first_.keyframes[k]));
  const int before = Duplicates(made_, made_.atlas.At(MapId{0}));
  ASSERT_GT(before, 300);
  mapper_.Apply(correction);
  const Map& map = made_.atlas.At(MapId{0});
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map));
  EXPECT_LT(Duplicates(made_, map), before / 5);
  for (KeyframeId id : {second.keyframes[2], second.keyframes[3], second.keyframes[4]})
    EXPECT_LT(PoseError(id), 0.03) << id.value;
}

TEST_F(ApplyTest, TwoMapsBecomeOneAndMappingGoesOnUnderTheOldName) {
  const MapId other = made_.AddMap();
  const Visit second = AddSecond(other);
  MapCorrection correction{other, MapId{0}, Nearly(drift_.Inverse()), {}, {}};
  for (size_t k : {2u, 3u, 4u})
    correction.ties.push_back(made_.Tie(second.keyframes[k], first_, first_.keyframes[k]));
  const double old_scale = made_.atlas.At(other).At(second.keyframes[4]).scale;
  mapper_.Apply(correction);
  const Map& map = made_.atlas.At(other);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map));
  EXPECT_EQ(map.id(), MapId{0});
  EXPECT_LT(WorstPoseError(), 0.05);

  // The Tracker still thinks in the old map's world and unit.
  const SE3 truth = LookDown({10, 0.3, 12}, 0);
  const SyntheticView view = world_.View(truth, {0.5, 0.3, 0, 20}, &made_.random);
  const SE3 last = made_.truth[static_cast<size_t>(second.keyframes[4].value)];
  const SE3 step = truth * last.Inverse();
  KeyframeRequest request{
      other,
      FrameOf(20, view),
      {second.keyframes[4], SE3(step.rotation(), drift_.scale() * step.translation()), old_scale},
      {},
      {}};
  for (size_t i = 0; i < view.landmark.size(); ++i) {
    if (view.landmark[i] < 0) continue;
    const LandmarkId id = second.landmark_of[static_cast<size_t>(view.landmark[i])];
    if (id.valid()) request.matches.push_back({static_cast<int>(i), id});
  }
  ASSERT_GT(request.matches.size(), 100u);
  const auto local_map = mapper_.InsertKeyframe(request);
  EXPECT_EQ(local_map->map, MapId{0});
  const SE3& found = local_map->keyframes[static_cast<size_t>(local_map->centre)].cam_from_world;
  EXPECT_LT(PoseDifference(found, truth), 0.05);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(made_.atlas.At(MapId{0})));
}

}  // namespace
}  // namespace deepuav
