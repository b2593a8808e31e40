#include "deepuav/system/frames/map_references.h"

#include <gtest/gtest.h>

#include "support/map_builder.h"
#include "support/synthetic_map.h"

namespace deepuav {
namespace {

/// A place that is looked at for long: keyframes come and go, their landmarks are fused into one.
class LongStay {
 public:
  LongStay() : map_(&atlas.Add(Map(MapId{0}))), random_(1) {
    first_ = AddKeyframe({});
    last_ = AddKeyframe(first_);
    kept = atlas.ids().NextLandmark();
    map_->AddLandmark(kept, Eigen::Vector3d::UnitZ(), last_);
    map_->AddObservation(first_, 0, kept);
    map_->AddObservation(last_, 0, kept);
  }

  /// What a frame refers to that was tracked beside the keyframe that goes then.
  FrameRecord Step() {
    const KeyframeId next = AddKeyframe(last_);
    const LandmarkId landmark = atlas.ids().NextLandmark();
    map_->AddLandmark(landmark, Eigen::Vector3d::UnitZ(), next);
    const int free = 1 + static_cast<int>(next.value % 2);  // The other shows `kept`.
    EXPECT_TRUE(map_->AddObservation(last_, free, landmark));
    EXPECT_TRUE(map_->AddObservation(next, free, landmark));
    FrameRecord record;
    record.map = MapId{0};
    record.pose.keyframe = last_;
    record.seen = {{landmark, {}}};
    record.cam_from_world = map_->At(last_).cam_from_world;
    map_->MergeLandmark(landmark, kept);
    map_->RemoveKeyframe(last_);
    last_ = next;
    return record;
  }

  const Map& map() const { return *map_; }

  Atlas atlas;
  LandmarkId kept;

 private:
  KeyframeId AddKeyframe(KeyframeId parent) {
    const KeyframeId id = atlas.ids().NextKeyframe();
    const auto features = std::make_shared<const Features>(
        RandomFeatures(5, 640, 480, MapBuilder::kDimension, &random_));
    map_->AddKeyframe(id, {FrameId{id.value}, Timestamp{id.value}, features}, RandomPose(&random_));
    if (parent.valid()) map_->ConnectToParent(id, parent);
    return id;
  }

  Map* map_;
  Random random_;
  KeyframeId first_, last_;
};

TEST(RemovedForgetter, MemoryOfRemovedThingsIsThatOfWhatRefersToThem) {
  LongStay stay;
  RemovedForgetter forgetter;
  std::vector<FrameRecord> records;
  for (int round = 0; round < 30; ++round) {
    for (int i = 0; i < 20; ++i) {
      const FrameRecord record = stay.Step();
      if (i == 7) records.push_back(record);
    }
    forgetter.Forget(ReferencesOf(records, nullptr), &stay.atlas);
    // Those referred to, and those of this round, whatever refers to them.
    EXPECT_EQ(stay.map().culled().size(), static_cast<size_t>(round + 20)) << round;
    EXPECT_EQ(stay.map().merged_into().size(), static_cast<size_t>(round + 20)) << round;
  }
  for (const FrameRecord& record : records) {
    EXPECT_LT(PoseDifference(stay.map().PoseOf(record.pose), record.cam_from_world), 1e-9);
    EXPECT_EQ(stay.map().Current(record.seen.front().landmark), stay.kept);
  }
  ASSERT_NO_FATAL_FAILURE(CheckConsistent(stay.map()));
  forgetter.Forget({}, &stay.atlas);
  EXPECT_TRUE(stay.map().culled().empty());
  EXPECT_TRUE(stay.map().merged_into().empty());
}

TEST(RemovedForgetter, WhatTheLocalMapHoldsIsReferredTo) {
  LongStay stay;
  RemovedForgetter forgetter;
  const FrameRecord record = stay.Step();
  LocalMap local_map;
  local_map.keyframes.push_back({record.pose.keyframe, SE3(), 1, nullptr, {}});
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  local_map.landmarks.push_back({record.seen.front().landmark, ahead, ahead});
  for (int i = 0; i < 3; ++i) {
    stay.Step();
    forgetter.Forget(ReferencesOf({}, &local_map), &stay.atlas);
    EXPECT_TRUE(stay.map().culled().contains(record.pose.keyframe)) << i;
    EXPECT_EQ(stay.map().Current(record.seen.front().landmark), stay.kept) << i;
  }
}

TEST(ReferencesOf, AFrameWithoutAPoseRefersToNoKeyframe) {
  FrameRecord lost;
  const MapReferences referred = ReferencesOf({lost}, nullptr);
  EXPECT_TRUE(referred.keyframes.empty());
  EXPECT_TRUE(referred.landmarks.empty());
}

}  // namespace
}  // namespace deepuav
