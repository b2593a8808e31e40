#include "deepuav/mapping/landmarks/fusion.h"

#include <gtest/gtest.h>

#include <set>

#include "deepuav/base/error.h"
#include "support/options_with.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

const PatchObserver kKeyPointsOnly(Camera{}, PatchOptions{.enabled = false}, {});

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

class FuseDuplicatesTest : public testing::Test {
 protected:
  FuseDuplicatesTest() {
    Random random(3);
    std::vector<SE3> poses;
    for (int i = 0; i < 6; ++i) poses.push_back(At({0.4 * i, 0, 0}));
    made_ = MakeTrueMap(world_, poses, {0.3, 0.3, 0, 30}, &random);
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(400, {-6, -4, 6}, {8, 4, 14}, &random);
    return FeatureWorld(geometry, 2);
  }
  int Shown(const Observation& o) const {
    return made_.views[static_cast<size_t>(o.keyframe.value)]
        .landmark[static_cast<size_t>(o.keypoint)];
  }
  /// Splits every third landmark seen by all six in two, of three observations each.
  int SplitSome() {
    int split = 0;
    for (size_t i = 0; i < made_.landmark_of.size(); i += 3) {
      const LandmarkId id = made_.landmark_of[i];
      if (!id.valid() || made_.map.At(id).observations.size() < 6) continue;
      const std::vector<Observation> observations = made_.map.At(id).observations;
      const LandmarkId twin = made_.ids.NextLandmark();
      const Eigen::Vector3d offset = 0.01 * Eigen::Vector3d(1, -1, 1);
      made_.map.AddLandmark(twin, made_.map.At(id).position_world + offset, {5});
      for (size_t k = 3; k < 6; ++k) {
        made_.map.RemoveObservation(observations[k].keyframe, id);
        made_.map.AddObservation(observations[k].keyframe, observations[k].keypoint, twin);
      }
      made_.map.UpdateAppearance(id);
      made_.map.UpdateAppearance(twin);
      ++split;
    }
    return split;
  }
  /// Landmarks of the world that several landmarks of the map stand for.
  int Duplicates() const {
    std::map<int, std::set<LandmarkId>> by_landmark;
    made_.map.landmarks().ForEach([&](const Landmark& landmark) {
      for (const Observation& o : landmark.observations) {
        by_landmark[Shown(o)].insert(landmark.id);
      }
    });
    int duplicates = 0;
    for (const auto& entry : by_landmark) duplicates += entry.second.size() > 1;
    return duplicates;
  }
  int WrongObservations() const {
    int wrong = 0;
    made_.map.landmarks().ForEach([&](const Landmark& landmark) {
      for (const Observation& o : landmark.observations) {
        wrong += Shown(o) != Shown(landmark.observations.front());
      }
    });
    return wrong;
  }
  int Observations() const {
    int count = 0;
    made_.map.landmarks().ForEach(
        [&count](const Landmark& l) { count += static_cast<int>(l.observations.size()); });
    return count;
  }

  const FeatureWorld world_ = MakeWorld();
  SyntheticMap made_;
};

TEST_F(FuseDuplicatesTest, MergesLandmarksThatAreOne) {
  const int before = made_.map.LandmarkCount(), observations = Observations();
  const int split = SplitSome();
  ASSERT_GT(split, 30);
  EXPECT_EQ(Duplicates(), split);
  FuseDuplicates(&made_.map, made_.keyframes.back(), world_.camera(), {}, kKeyPointsOnly);
  EXPECT_LE(Duplicates(), split / 20);
  EXPECT_NEAR(made_.map.LandmarkCount(), before, split / 20);
  EXPECT_GE(Observations(), observations - split / 10);
  EXPECT_EQ(WrongObservations(), 0);
}

TEST_F(FuseDuplicatesTest, AddsObservationsThatWereMissing) {
  const int all = Observations();
  int removed = 0;
  const Keyframe newest = made_.map.At(made_.keyframes.back());
  for (size_t i = 0; i < newest.landmarks.size(); i += 2) {
    const LandmarkId id = newest.landmarks[i];
    if (!id.valid() || made_.map.At(id).observations.size() < 4) continue;
    made_.map.RemoveObservation(newest.id, id);
    made_.map.UpdateAppearance(id);
    ++removed;
  }
  ASSERT_GT(removed, 40);
  ASSERT_EQ(Observations(), all - removed);
  FuseDuplicates(&made_.map, newest.id, world_.camera(), {}, kKeyPointsOnly);
  EXPECT_GT(Observations(), all - removed / 20);
  EXPECT_EQ(WrongObservations(), 0);
}

TEST_F(FuseDuplicatesTest, ChangesNothingWhereAllIsKnown) {
  const int landmarks = made_.map.LandmarkCount(), observations = Observations();
  FuseDuplicates(&made_.map, made_.keyframes[2], world_.camera(), {}, kKeyPointsOnly);
  EXPECT_EQ(made_.map.LandmarkCount(), landmarks);
  EXPECT_EQ(Observations(), observations);
}

TEST_F(FuseDuplicatesTest, RenewsTheViewRangeOfWhatItChanged) {
  SplitSome();
  FuseDuplicates(&made_.map, made_.keyframes.back(), world_.camera(), {}, kKeyPointsOnly);
  Random random(3);
  made_.map.landmarks().ForEach([&](const Landmark& landmark) {
    double least = 1e9, most = 0;
    for (const Observation& o : landmark.observations) {
      const double distance =
          (made_.map.At(o.keyframe).cam_from_world * landmark.position_world).norm();
      least = std::min(least, distance);
      most = std::max(most, distance);
    }
    EXPECT_NEAR(landmark.min_distance, least, 1e-9);
    EXPECT_NEAR(landmark.max_distance, most, 1e-9);
  });
}

TEST(FusionOptions, RefusesWhatCannotBe) {
  EXPECT_NO_THROW(FusionOptions().Check());
  EXPECT_THROW(OptionsWith(&FusionOptions::radius_px, 0).Check(), Error);
  EXPECT_THROW(OptionsWith(&FusionOptions::max_neighbours, 0).Check(), Error);
}

}  // namespace
}  // namespace deepuav
