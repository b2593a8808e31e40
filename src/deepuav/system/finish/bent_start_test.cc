#include "deepuav/system/finish/bent_start.h"

#include <gtest/gtest.h>

#include "deepuav/mapping/keyframe_relocation.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "support/straight_flight.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};
constexpr size_t kBent = 3;       // Keyframes at the beginning.
constexpr int kFirstFrames = 13;  // As many as hold them.
const SE3 kBend = LookDown({0, 0, 0}, 0) * LookDown({-0.6, 0.3, 0.2}, 0.02).Inverse();

/// A map of a slow flight, all of which sees the same ground, and records of its frames.
class BentStartTest : public testing::Test, protected StraightFlight {
 protected:
  BentStartTest() {
    SyntheticMap made = MakeTrueMap(world_, Keyframes(), kNoise, &random_);
    keyframes_ = made.keyframes;
    map_ = std::move(made.map);
    ids_ = made.ids;
    for (size_t k = 0; k < keyframes_.size(); ++k) {
      Frame frame = map_.At(keyframes_[k]).frame;
      frame.id = FrameId{static_cast<int64_t>(k) * kFramesAKeyframe};
      frame.time = FrameOf(frame.id.value, made.views[k]).time;
      map_.SetFrame(keyframes_[k], frame);
    }
    for (int i = 0; i < kFrames; ++i) records_.push_back(RecordOf(i));
  }

  static SE3 SlowPoseAt(int frame) { return PoseAt(0.25 * frame); }
  static std::vector<SE3> Keyframes() {
    std::vector<SE3> poses;
    for (int k = 0; k < kKeyframes; ++k) poses.push_back(SlowPoseAt(kFramesAKeyframe * k));
    return poses;
  }

  FrameRecord RecordOf(int i) {
    const Frame frame = FrameOf(i, world_.View(SlowPoseAt(i), kNoise, &random_));
    const Keyframe& near = map_.At(keyframes_[KeyframeOf(i)]);
    TrackingResult result;
    result.state = TrackingState::kTracking;
    result.pose = TrackedPose{
        map_.id(), {near.id, SlowPoseAt(i) * near.cam_from_world.Inverse(), 1}, {}, SlowPoseAt(i)};
    return MakeRecord(frame, result);
  }

  /// The first keyframes hold together, elsewhere, by landmarks that are theirs alone.
  void Bend() {
    std::map<LandmarkId, std::vector<std::pair<KeyframeId, int>>> seen;
    for (size_t k = 0; k < kBent; ++k) {
      const Keyframe keyframe = map_.At(keyframes_[k]);
      for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
        if (keyframe.landmarks[i].valid())
          seen[keyframe.landmarks[i]].emplace_back(keyframe.id, static_cast<int>(i));
      }
    }
    for (const auto& [landmark, observations] : seen) {
      if (observations.size() < 2) continue;
      const Eigen::Vector3d moved = kBend * map_.At(landmark).position_world;
      for (const auto& [keyframe, keypoint] : observations) {
        if (map_.Contains(landmark)) map_.RemoveObservation(keyframe, landmark);
      }
      const LandmarkId own = ids_.NextLandmark();
      map_.AddLandmark(own, moved, observations.back().first);
      for (const auto& [keyframe, keypoint] : observations)
        map_.AddObservation(keyframe, keypoint, own);
      map_.UpdateAppearance(own);
    }
    for (size_t k = 0; k < kBent; ++k) {
      const Keyframe keyframe = map_.At(keyframes_[k]);
      for (const LandmarkId landmark : keyframe.landmarks) {
        if (landmark.valid() && map_.At(landmark).observations.back().keyframe >= keyframes_[kBent])
          map_.RemoveObservation(keyframe.id, landmark);
      }
      map_.SetPose(keyframe.id, keyframe.cam_from_world * kBend.Inverse());
    }
    for (FrameRecord& record : records_) record.cam_from_world = map_.PoseOf(record.pose);
  }

  std::vector<KeyframeRelocation> Find(BentStartOptions options = {}) {
    options.min_later_keyframes = std::min(options.min_later_keyframes, 3);
    FrameLocator locator(world_.camera(), {}, &matcher_, nullptr);
    return BentStart(world_.camera().pinhole, options, {}, kFirstFrames, first_new_, &locator)
        .FindIn(map_, records_);
  }

  double Error(size_t k, const SE3& cam_from_world) const {
    const SE3 truth = SlowPoseAt(static_cast<int>(k) * kFramesAKeyframe);
    return (cam_from_world.InverseTranslation() - truth.InverseTranslation()).norm();
  }

  const FeatureWorld world_{Ground(), 2};
  Random random_{3};
  NearestNeighbourMatcher matcher_{{}};
  Map map_{MapId{0}};
  IdSource ids_;
  std::vector<KeyframeId> keyframes_;
  std::vector<FrameRecord> records_;
  KeyframeId first_new_{0};
};

TEST_F(BentStartTest, FindsTheFirstKeyframesWhereLaterOnesSeeThem) {
  Bend();
  ASSERT_GT(Error(0, map_.At(keyframes_[0]).cam_from_world), 0.5);
  const auto found = Find();
  ASSERT_EQ(found.size(), kBent);
  for (size_t k = 0; k < kBent; ++k) {
    EXPECT_EQ(found[k].keyframe, keyframes_[k]);
    EXPECT_LT(Error(k, found[k].cam_from_world), 0.05) << k;
    EXPECT_GT(found[k].matches.size(), 50u) << k;
  }
}

TEST_F(BentStartTest, AMapIsWholeOnceTheyAreThere) {
  Bend();
  Relocate(Find(), &map_);
  for (size_t k = 0; k < kBent; ++k) {
    EXPECT_LT(Error(k, map_.At(keyframes_[k]).cam_from_world), 0.05) << k;
    EXPECT_GT(map_.Covisible(keyframes_[k], 20, 10).size(), 2u) << k;
  }
  EXPECT_EQ(map_.root(), keyframes_[0]);
  EXPECT_TRUE(Find().empty()) << "they agree now";
}

TEST_F(BentStartTest, LeavesAStartThatAgrees) { EXPECT_TRUE(Find().empty()); }

TEST_F(BentStartTest, LeavesWhatTheLaterMapDoesNotShow) {
  Bend();
  for (size_t i = 0; i < kFirstFrames; ++i) {
    if (i % kFramesAKeyframe != 0) records_[i].features.reset();
  }
  for (size_t k = 0; k < kBent; ++k) {
    Frame dark = map_.At(keyframes_[k]).frame;
    const SyntheticView other = world_.View(LookDown({-6, 6, 3}, 2), kNoise, &random_);
    dark.features = other.features;
    map_.SetFrame(keyframes_[k], dark);
  }
  EXPECT_TRUE(Find().empty());
}

TEST_F(BentStartTest, AsksOnlyAMapThatWentOn) {
  Bend();
  BentStartOptions options;
  records_.resize(kFirstFrames);
  EXPECT_TRUE(Find(options).empty());
  options.enabled = false;
  EXPECT_TRUE(Find(options).empty());
}

TEST_F(BentStartTest, LeavesKeyframesThatWereLoaded) {
  Bend();
  first_new_ = keyframes_[1];
  for (const KeyframeRelocation& relocation : Find()) EXPECT_GE(relocation.keyframe, first_new_);
}

}  // namespace
}  // namespace deepuav
