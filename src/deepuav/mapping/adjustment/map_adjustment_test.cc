#include "deepuav/mapping/adjustment/map_adjustment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/synthetic_map.h"

namespace deepuav {
namespace {

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

class AdjustWindowTest : public testing::Test {
 protected:
  AdjustWindowTest() {
    Random random(3);
    for (int i = 0; i < 8; ++i) poses_.push_back(At({0.4 * i, 0.02 * i * i, 0}));
    made_ = MakeTrueMap(world_, poses_, {0.3, 0.3, 0, 0}, &random);
  }

  static FeatureWorld MakeWorld() {
    Random random(1);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(300, {-6, -4, 6}, {9, 4, 14}, &random);
    return FeatureWorld(geometry, 2);
  }
  std::vector<LandmarkId> Landmarks() const {
    std::vector<LandmarkId> ids;
    made_.map.landmarks().ForEach([&ids](const Landmark& l) { ids.push_back(l.id); });
    return ids;
  }
  void Disturb(const std::vector<KeyframeId>& keyframes) {
    Random random(4);
    for (KeyframeId id : keyframes) {
      made_.map.SetPose(id, Perturbed(made_.map.At(id).cam_from_world, 0.05, 0.005, &random));
    }
    for (LandmarkId id : Landmarks()) {
      made_.map.SetPosition(id, made_.map.At(id).position_world + 0.1 * RandomDirection(&random));
    }
  }
  double CentreError(KeyframeId id) const {
    const SE3& truth = poses_[static_cast<size_t>(id.value)];
    return (made_.map.At(id).cam_from_world.InverseTranslation() - truth.InverseTranslation())
        .norm();
  }
  BundleReport Adjust(const std::vector<KeyframeId>& free) {
    return AdjustWindow(&made_.map, free, world_.world().pinhole, {}, {});
  }

  const FeatureWorld world_ = MakeWorld();
  std::vector<SE3> poses_;
  SyntheticMap made_;
};

TEST_F(AdjustWindowTest, BringsPosesAndLandmarksBack) {
  const std::vector<KeyframeId> free(made_.keyframes.begin() + 4, made_.keyframes.end());
  Disturb(free);
  for (KeyframeId id : free) ASSERT_GT(CentreError(id), 0.03);
  const BundleReport report = Adjust(free);
  EXPECT_LE(report.final_cost, report.initial_cost);
  for (KeyframeId id : free) EXPECT_LT(CentreError(id), 0.01) << id.value;
  double sum = 0;
  for (size_t i = 0; i < made_.landmark_of.size(); ++i) {
    if (!made_.map.Current(made_.landmark_of[i])) continue;
    sum += (made_.map.At(made_.landmark_of[i]).position_world - world_.landmarks()[i]).norm();
  }
  EXPECT_LT(sum / made_.map.LandmarkCount(), 0.05);
}

TEST_F(AdjustWindowTest, HoldsTheOthersAndTheRootStill) {
  Disturb(made_.keyframes);
  std::vector<SE3> before;
  for (KeyframeId id : made_.keyframes) before.push_back(made_.map.At(id).cam_from_world);
  Adjust({made_.keyframes[0], made_.keyframes[3], made_.keyframes[4]});
  for (size_t k = 0; k < before.size(); ++k) {
    const bool moved =
        made_.map.At(made_.keyframes[k]).cam_from_world.Matrix() != before[k].Matrix();
    EXPECT_EQ(moved, k == 3 || k == 4) << k;
  }
}

TEST_F(AdjustWindowTest, RemovesWrongObservations) {
  int wrong = 0;
  for (LandmarkId id : Landmarks()) {
    if (id.value % 8 != 0 || made_.map.At(id).observations.size() < 5) continue;
    // The key point of another landmark is taken for this one.
    const Keyframe& keyframe = made_.map.At(made_.map.At(id).observations[2].keyframe);
    for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const LandmarkId other = keyframe.landmarks[i];
      if (!other.valid() || other.value % 8 == 0) continue;
      if (made_.map.At(other).observations.size() < 5) continue;
      made_.map.RemoveObservation(keyframe.id, other);
      made_.map.RemoveObservation(keyframe.id, id);
      ASSERT_TRUE(made_.map.AddObservation(keyframe.id, static_cast<int>(i), id));
      ++wrong;
      break;
    }
  }
  ASSERT_GT(wrong, 5);
  Disturb({made_.keyframes[5]});
  Adjust(made_.keyframes);
  int left = 0;
  made_.map.landmarks().ForEach([&](const Landmark& landmark) {
    for (const Observation& o : landmark.observations) {
      const int shown = made_.views[static_cast<size_t>(o.keyframe.value)]
                            .landmark[static_cast<size_t>(o.keypoint)];
      left += made_.landmark_of[static_cast<size_t>(shown)] != landmark.id;
    }
  });
  EXPECT_EQ(left, 0);
  for (KeyframeId id : made_.keyframes) EXPECT_LT(CentreError(id), 0.05);
}

TEST_F(AdjustWindowTest, StopsWhenAsked) {
  Disturb({made_.keyframes[5]});
  const double before = CentreError(made_.keyframes[5]);
  int asked = 0;
  AdjustWindow(&made_.map, {made_.keyframes[5]}, world_.world().pinhole, {}, {}, [&asked] {
    ++asked;
    return true;
  });
  EXPECT_GE(asked, 1);
  EXPECT_LE(asked, 4);
  EXPECT_LE(CentreError(made_.keyframes[5]), before + 1e-9);
}

TEST_F(AdjustWindowTest, AStoppedOneTakesNothingForAnOutlier) {
  const auto observations = [this] {
    size_t count = 0;
    made_.map.landmarks().ForEach([&](const Landmark& l) { count += l.observations.size(); });
    return count;
  };
  const size_t before = observations();
  Pinhole pinhole = world_.world().pinhole;
  pinhole.fx = pinhole.fy = 1.2 * pinhole.fx;
  AdjustMap(&made_.map, &pinhole, {}, {}, [] { return true; });
  EXPECT_EQ(observations(), before);
}

/// Cameras around landmarks, whose turns tell the focal length.
SyntheticMap MapAllAround(double focal_error) {
  Random random(5);
  SyntheticWorld geometry;
  geometry.landmarks_world = LandmarksInBox(300, {-4, -4, -3}, {4, 4, 3}, &random);
  const FeatureWorld world(geometry, 6);
  SyntheticMap made =
      MakeTrueMap(world, OrbitPath(10, {0, 0, 0}, 12, 3, 2.5), {0.3, 0.3, 0, 0}, &random);
  // As mapped with the wrong focal length: depths grow with it.
  made.map.landmarks().ForEach([&](const Landmark& landmark) {
    made.map.SetPosition(landmark.id,
                         landmark.position_world + 0.2 * focal_error * RandomDirection(&random));
  });
  return made;
}

TEST(AdjustMap, FindsTheFocalLengthWhereAsked) {
  const double truth = SyntheticWorld().pinhole.fx;
  for (const double factor : {0.93, 1.06}) {
    for (const bool refine : {true, false}) {
      SyntheticMap made = MapAllAround(factor - 1);
      Pinhole pinhole = SyntheticWorld().pinhole;
      pinhole.fx = pinhole.fy = factor * truth;
      BundleOptions options{.max_iterations = 50, .min_relative_decrease = 1e-9};
      options.refine_focal = refine;
      AdjustMap(&made.map, &pinhole, options, {});
      EXPECT_NEAR(pinhole.fx, refine ? truth : factor * truth, refine ? 0.005 * truth : 0);
      EXPECT_EQ(pinhole.fx, pinhole.fy);
      EXPECT_EQ(pinhole.cx, SyntheticWorld().pinhole.cx);
    }
  }
}

/// A flight above ground, over which things drive the other way: each seems to stand at a third of
/// the height, nearly.
class DrivingTest : public testing::Test {
 protected:
  static constexpr int kGround = 260, kDriving = 30;
  static constexpr double kFlown = 0.4;

  DrivingTest() {
    Random random(6);
    SyntheticWorld geometry;
    geometry.landmarks_world = LandmarksInBox(kGround, {-7, -4, 9.5}, {10, 4, 10.5}, &random);
    const FeatureWorld ground(geometry, 2);
    for (int i = 0; i < 9; ++i) poses_.push_back(At({kFlown * i, 0, 0}));
    made_ = MakeTrueMap(ground, poses_, {0.1, 0.3, 0, kDriving}, &random);
    for (int i = 0; i < kDriving; ++i) AddDriving(i, geometry.pinhole, &random);
    for (size_t k = 1; k < poses_.size(); ++k)
      made_.map.SetPose(made_.keyframes[k], Perturbed(poses_[k], 0.01, 0.001, &random));
  }

  /// On a key point of no landmark in each of four keyframes. It weaves, so that no pose of a
  /// steady flight explains it.
  void AddDriving(int i, const Pinhole& pinhole, Random* random) {
    const int first = i % 5;
    const Eigen::Vector3d start(kFlown * first + random->Uniform(-1, 3), random->Uniform(-3, 3),
                                10);
    const Eigen::Vector3d seems =
        poses_[static_cast<size_t>(first)].InverseTranslation() +
        (start - poses_[static_cast<size_t>(first)].InverseTranslation()) / 3;
    const LandmarkId id{100'000 + i};
    made_.map.AddLandmark(id, seems, made_.keyframes[static_cast<size_t>(first)]);
    driving_.push_back(id);
    for (int k = first; k < first + 4; ++k) {
      const Eigen::Vector3d there =
          start + Eigen::Vector3d(-2 * kFlown * (k - first), 0.02 * (k - first) * (k - first), 0);
      const Eigen::Vector2d px = pinhole.Project(poses_[static_cast<size_t>(k)] * there);
      const KeyframeId view = made_.keyframes[static_cast<size_t>(k)];
      for (size_t point = 0; point < made_.map.At(view).landmarks.size(); ++point) {
        if (made_.map.At(view).landmarks[point].valid()) continue;
        ASSERT_TRUE(made_.map.AddObservation(view, static_cast<int>(point), id,
                                             PixelMeasurement{px.cast<float>(), 0.1, true}));
        break;
      }
    }
  }

  double Error() const {
    double squared = 0;
    for (size_t k = 0; k < poses_.size(); ++k) {
      squared += (made_.map.At(made_.keyframes[k]).cam_from_world.InverseTranslation() -
                  poses_[k].InverseTranslation())
                     .squaredNorm();
    }
    return std::sqrt(squared / static_cast<double>(poses_.size()));
  }

  std::vector<SE3> poses_;
  SyntheticMap made_;
  std::vector<LandmarkId> driving_;
};

TEST_F(DrivingTest, WhatHoversHoldsNoPoses) {
  MapTrust trust;
  trust.reweighing.rounds = 0;
  Pinhole pinhole = SyntheticWorld().pinhole;
  SyntheticMap trusting = made_;
  AdjustMap(&made_.map, &pinhole, {}, TrustInAll());
  const double bent = Error();
  made_ = trusting;
  AdjustMap(&made_.map, &pinhole, {}, trust);
  EXPECT_LT(Error(), 0.5 * bent);
}

TEST_F(DrivingTest, AStoppedOneTakesNothingForAnOutlier) {
  const auto observations = [this] {
    size_t count = 0;
    made_.map.landmarks().ForEach([&](const Landmark& l) { count += l.observations.size(); });
    return count;
  };
  const size_t before = observations();
  Pinhole pinhole = SyntheticWorld().pinhole;
  AdjustMap(&made_.map, &pinhole, {}, {}, [] { return true; });
  EXPECT_EQ(observations(), before);
}

TEST_F(DrivingTest, WhatStandsAboveTheGroundStays) {
  const KeyframeId view = made_.keyframes[4];
  Pinhole pinhole = SyntheticWorld().pinhole;
  const Eigen::Vector3d tower(1.8, 0.5, 4);
  const LandmarkId id{200'000};
  made_.map.AddLandmark(id, tower + Eigen::Vector3d(0, 0, 0.1), view);
  for (size_t k = 2; k < 7; ++k) {
    const KeyframeId seeing = made_.keyframes[k];
    const std::vector<LandmarkId>& seen = made_.map.At(seeing).landmarks;
    const auto point = std::ranges::find_if(seen, [](LandmarkId l) { return !l.valid(); });
    ASSERT_NE(point, seen.end());
    const Eigen::Vector2d px = pinhole.Project(poses_[k] * tower);
    ASSERT_TRUE(made_.map.AddObservation(seeing, static_cast<int>(point - seen.begin()), id,
                                         PixelMeasurement{px.cast<float>(), 0.3, true}));
  }
  AdjustMap(&made_.map, &pinhole, {}, {});
  ASSERT_TRUE(made_.map.Contains(id));
  EXPECT_GE(made_.map.At(id).observations.size(), 4u);
  EXPECT_LT((made_.map.At(id).position_world - tower).norm(), 0.05);
}

}  // namespace
}  // namespace deepuav
