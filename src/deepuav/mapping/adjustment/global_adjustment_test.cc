#include "deepuav/mapping/adjustment/global_adjustment.h"

#include <gtest/gtest.h>

#include "deepuav/mapping/adjustment/map_adjustment.h"
#include "support/map_builder.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

constexpr BundleOptions kOptions{.max_iterations = 30, .min_relative_decrease = 1e-9};

/// A map of true poses that was disturbed.
class GlobalAdjustmentTest : public testing::Test {
 protected:
  GlobalAdjustmentTest() {
    made_.AddMap();
    visit_ = made_.Add(MapId{0}, FlightAlongStrip(0, 8), {}, {0.3, 0.3, 0, 0});
    Random random(4);
    for (size_t k = 2; k < visit_.keyframes.size(); ++k) {
      const SE3 disturbed =
          Perturbed(map().At(visit_.keyframes[k]).cam_from_world, 0.02 * double(k), 0.002, &random);
      map().SetPose(visit_.keyframes[k], disturbed);
    }
    for (LandmarkId id : Landmarks())
      map().SetPosition(id, map().At(id).position_world + 0.05 * RandomDirection(&random));
  }

  Map& map() { return made_.atlas.At(MapId{0}); }
  std::vector<LandmarkId> Landmarks() {
    std::vector<LandmarkId> ids;
    map().landmarks().ForEach([&ids](const Landmark& l) { ids.push_back(l.id); });
    return ids;
  }
  GlobalAdjustment Prepare() { return GlobalAdjustment(map(), world_.world().pinhole, kOptions); }
  double PoseError(KeyframeId id) {
    return PoseDifference(map().PoseOf(id), made_.truth[static_cast<size_t>(id.value)]);
  }
  double MeanPoseError() {
    double sum = 0;
    for (KeyframeId id : visit_.keyframes) sum += PoseError(id);
    return sum / static_cast<double>(visit_.keyframes.size());
  }
  void ExpectViewRangesUpToDate() {
    for (LandmarkId id : Landmarks()) {
      const Landmark before = map().At(id);
      map().UpdateViewRange(id);
      ASSERT_LT((map().At(id).mean_view_direction - before.mean_view_direction).norm(), 1e-12);
      ASSERT_NEAR(map().At(id).max_distance, before.max_distance, 1e-12);
    }
  }

  const FeatureWorld world_ = StripOfGround(1, 800);
  SyntheticVisits made_{world_, 2};
  Visit visit_;
};

TEST_F(GlobalAdjustmentTest, DoesToAStillMapWhatAdjustMapDoes) {
  Atlas copy = [this] {
    SyntheticVisits again(world_, 2);
    again.AddMap();
    again.Add(MapId{0}, FlightAlongStrip(0, 8), {}, {0.3, 0.3, 0, 0});
    return std::move(again.atlas);
  }();
  Map& directly = copy.At(MapId{0});
  for (KeyframeId id : visit_.keyframes) directly.SetPose(id, map().At(id).cam_from_world);
  for (LandmarkId id : Landmarks()) directly.SetPosition(id, map().At(id).position_world);
  Pinhole pinhole = world_.world().pinhole;
  AdjustMap(&directly, &pinhole, kOptions, TrustInAll());

  const double before = MeanPoseError();
  GlobalAdjustment adjustment = Prepare();
  EXPECT_EQ(adjustment.map(), MapId{0});
  adjustment.Compute();
  EXPECT_EQ(MeanPoseError(), before) << "nothing moves until it is applied";
  adjustment.Apply(&map());
  EXPECT_LT(MeanPoseError(), before / 2) << "the scale is free";
  for (KeyframeId id : visit_.keyframes) {
    EXPECT_LT(PoseDifference(map().At(id).cam_from_world, directly.At(id).cam_from_world), 1e-4)
        << id.value;
  }
  double difference = 0;
  for (LandmarkId id : Landmarks()) {
    if (directly.Contains(id))
      difference += (map().At(id).position_world - directly.At(id).position_world).norm();
  }
  EXPECT_LT(difference / map().LandmarkCount(), 1e-4);
  ExpectViewRangesUpToDate();
}

TEST_F(GlobalAdjustmentTest, CarriesAlongAKeyframeThatSeesNothing) {
  const KeyframeId blind = visit_.keyframes.back();
  for (LandmarkId id : std::vector<LandmarkId>(map().At(blind).landmarks)) {
    if (id.valid()) map().RemoveObservation(blind, id);
  }
  const KeyframeId parent = map().At(blind).parent;
  const SE3 from_parent =
      map().At(blind).cam_from_world * map().At(parent).cam_from_world.Inverse();
  const SE3 before = map().At(parent).cam_from_world;
  GlobalAdjustment adjustment = Prepare();
  adjustment.Compute();
  adjustment.Apply(&map());
  ASSERT_GT(PoseDifference(map().At(parent).cam_from_world, before), 0.01);
  EXPECT_LT(
      PoseDifference(map().At(blind).cam_from_world, from_parent * map().At(parent).cam_from_world),
      1e-9);
}

TEST_F(GlobalAdjustmentTest, CarriesAlongWhatWasMadeMeanwhile) {
  GlobalAdjustment adjustment = Prepare();
  // As tracked against the last keyframe, which was off.
  const KeyframeId last = visit_.keyframes.back();
  ASSERT_GT(PoseError(last), 0.1);
  const SE3 true_last = made_.truth.back();
  const SE3 mapped_from_true = map().At(last).cam_from_world.Inverse() * true_last;
  const Visit newer = made_.Add(MapId{0}, FlightAlongStrip(16, 3), Sim3(mapped_from_true));
  ASSERT_EQ(map().At(newer.keyframes[0]).parent, last);
  ASSERT_EQ(map().At(newer.keyframes[2]).parent, newer.keyframes[1]);
  adjustment.Compute();
  adjustment.Apply(&map());
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map()));
  EXPECT_LT(PoseError(last), 0.07);
  const SE3 moved = map().At(last).cam_from_world.Inverse() * true_last;
  for (KeyframeId id : newer.keyframes) {
    const SE3 expected = made_.truth[static_cast<size_t>(id.value)] * moved.Inverse();
    EXPECT_LT(PoseDifference(map().At(id).cam_from_world, expected), 1e-9) << id.value;
  }
  for (size_t i = 0; i < newer.landmark_of.size(); ++i) {
    if (!newer.landmark_of[i].valid()) continue;
    const Eigen::Vector3d expected = moved * world_.landmarks()[i];
    ASSERT_LT((map().At(newer.landmark_of[i]).position_world - expected).norm(), 1e-9);
  }
  ExpectViewRangesUpToDate();
}

TEST_F(GlobalAdjustmentTest, TakesWhatDoesNotFitFromTheMap) {
  const KeyframeId keyframe = visit_.keyframes[4];
  std::vector<int> keypoints;
  for (int i = 0; i < std::ssize(map().At(keyframe).landmarks); ++i) {
    if (map().At(keyframe).landmarks[static_cast<size_t>(i)].valid()) keypoints.push_back(i);
  }
  const auto landmark_at = [&](int keypoint) {
    return map().At(keyframe).landmarks[static_cast<size_t>(keypoint)];
  };
  const int a = keypoints.front(), b = keypoints.back();
  const LandmarkId of_a = landmark_at(a), of_b = landmark_at(b);
  map().RemoveObservation(keyframe, of_a);
  map().RemoveObservation(keyframe, of_b);
  map().AddObservation(keyframe, a, of_b);
  map().AddObservation(keyframe, b, of_a);
  const auto observations = [&] {
    size_t count = 0;
    map().landmarks().ForEach([&](const Landmark& l) { count += l.observations.size(); });
    return count;
  };
  const size_t before = observations();
  GlobalAdjustment adjustment = Prepare();
  adjustment.Compute();
  EXPECT_EQ(observations(), before) << "nothing goes until it is applied";
  adjustment.Apply(&map());
  EXPECT_FALSE(landmark_at(a).valid());
  EXPECT_FALSE(landmark_at(b).valid());
  EXPECT_GE(observations(), before - before / 100) << "what fits stays";
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map()));
  ExpectViewRangesUpToDate();
}

TEST_F(GlobalAdjustmentTest, StandsWhatWasCulledAndMovedMeanwhile) {
  GlobalAdjustment adjustment = Prepare();
  adjustment.Compute();
  const LandmarkId gone = Landmarks()[3], merged = Landmarks()[4], into = Landmarks()[5];
  map().RemoveLandmark(gone);
  map().MergeLandmark(merged, into);
  const KeyframeId culled = visit_.keyframes[4];
  map().RemoveKeyframe(culled);
  const KeyframeId moved = visit_.keyframes[6];
  map().SetPose(moved, Perturbed(map().At(moved).cam_from_world, 0.3, 0.01, &made_.random));
  map().Reroot(visit_.keyframes[3]);
  adjustment.Apply(&map());
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map()));
  EXPECT_FALSE(map().Contains(culled));
  EXPECT_FALSE(map().Contains(gone));
  for (KeyframeId id : visit_.keyframes) {
    if (id == culled) continue;
    EXPECT_LT(PoseError(id), 0.06) << id.value;
  }
  // It hangs as it was found, disturbed, on its parent.
  EXPECT_LT(PoseError(culled), 0.3);
}

TEST_F(GlobalAdjustmentTest, StopsWhenAskedAndCanStillBeApplied) {
  GlobalAdjustment adjustment = Prepare();
  const double before = MeanPoseError();
  int asked = 0;
  adjustment.Compute([&asked] { return ++asked > 0; });
  EXPECT_GE(asked, 1);
  EXPECT_LE(asked, 3);
  adjustment.Apply(&map());
  EXPECT_LE(MeanPoseError(), before + 1e-9);
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(map()));
}

}  // namespace
}  // namespace deepuav
