#include "deepuav/system/finish/brief_maps.h"

#include <gtest/gtest.h>

#include <span>

#include "deepuav/matching/nearest_neighbour.h"
#include "support/straight_flight.h"

namespace deepuav {
namespace {

constexpr double kBriefScale = 2.5;
constexpr int kFirstBrief = 11, kLastBrief = 13;  // between keyframes of the other map
constexpr FeatureNoise kNoise{0.5, 0.3, 0, 30};
constexpr MapId kAround{0}, kBrief{1};
constexpr double kBriefS = 0.2;  // more than the frames above last

/// A flight with a map, of which some frames in the middle lie in a map of their own.
class BriefMapsTest : public testing::Test, protected StraightFlight {
 protected:
  BriefMapsTest() {
    SyntheticMap made = MakeTrueMap(world_, KeyframePoses(), kNoise, &random_);
    keyframes_ = made.keyframes;
    atlas_.ids() = made.ids;
    atlas_.Add(std::move(made.map));
    Map brief(kBrief);
    for (int i = kFirstBrief; i <= kLastBrief; i += 2) {
      const KeyframeId id = atlas_.ids().NextKeyframe();
      brief.AddKeyframe(id, FrameAt(i), BriefPoseAt(i));
      brief_keyframes_.push_back(id);
    }
    atlas_.Add(std::move(brief));
    for (int i = 0; i < kFrames; ++i) records_.push_back(RecordOf(i));
  }

  static bool IsBrief(int i) { return i >= kFirstBrief && i <= kLastBrief; }
  /// The brief map has a scale and a place of its own.
  static SE3 BriefPoseAt(int i) {
    const SE3 pose = PoseAt(i);
    return SE3(pose.rotation(), kBriefScale * pose.translation() + Eigen::Vector3d(0, 0, 3));
  }
  Frame FrameAt(int i) { return FrameOf(1000 + i, world_.View(PoseAt(i), kNoise, &random_)); }
  FrameRecord RecordOf(int i) {
    const MapId map = IsBrief(i) ? kBrief : kAround;
    const SE3 cam_from_world = IsBrief(i) ? BriefPoseAt(i) : PoseAt(i);
    const KeyframeId near = IsBrief(i) ? brief_keyframes_[0] : keyframes_[KeyframeOf(i)];
    TrackingResult result;
    result.state = TrackingState::kTracking;
    result.pose = TrackedPose{
        map, {near, cam_from_world * atlas_.At(map).At(near).cam_from_world.Inverse(), 1}, {}};
    FrameRecord record = MakeRecord(FrameAt(i), result);
    record.cam_from_world = cam_from_world;
    if (!IsBrief(i) || i % 2 != 0) record.features.reset();  // of sure frames and of keyframes
    return record;
  }

  /// What the end of a run does. How many maps were given up.
  int Finish(double max_s, KeyframeId first_new_keyframe = {0}) {
    BriefMaps brief(&atlas_, first_new_keyframe, max_s);
    brief.SetAside(&records_);
    FrameLocator locator(world_.camera(), {}, &matcher_, nullptr);
    const TrajectoryFinish finish(world_.camera(), {}, {}, 10, atlas_, KeyframeId{0}, &locator);
    finish.Finish(&records_);
    Mapper mapper(world_.camera(), {}, &atlas_, nullptr);
    return brief.Restore(finish, nullptr, &mapper, &records_);
  }
  double Error(int i) const {
    return PositionError(records_[static_cast<size_t>(i)].cam_from_world, i);
  }

  const FeatureWorld world_{Ground(), 2};
  Random random_{3};
  NearestNeighbourMatcher matcher_{{}};
  Atlas atlas_;
  std::vector<KeyframeId> keyframes_, brief_keyframes_;
  std::vector<FrameRecord> records_;
};

TEST_F(BriefMapsTest, ItsFramesAreFoundInTheMapAroundIt) {
  EXPECT_EQ(Finish(10), 1);
  for (int i = kFirstBrief; i <= kLastBrief; ++i) {
    const FrameRecord& record = records_[static_cast<size_t>(i)];
    EXPECT_EQ(record.map, kAround) << i;
    EXPECT_LT(Error(i), 0.05) << i;
    EXPECT_TRUE(record.tracked_online);
  }
  EXPECT_EQ(atlas_.Remaining(), std::vector<MapId>{kAround});
  EXPECT_EQ(atlas_.Current(kBrief), kAround);
}

TEST_F(BriefMapsTest, FramesThatAreNotFoundKeepTheirs) {
  FrameRecord& elsewhere = records_[kFirstBrief + 1];
  elsewhere.features = std::make_shared<const Features>(
      RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random_));
  const SE3 pose = elsewhere.cam_from_world;
  EXPECT_EQ(Finish(10), 0);
  EXPECT_EQ(elsewhere.map, kBrief);
  EXPECT_LT((elsewhere.cam_from_world * pose.Inverse()).Log().norm(), 1e-9);
  EXPECT_EQ(records_[kFirstBrief].map, kAround);
  EXPECT_EQ(atlas_.Remaining().size(), 2u);
}

TEST_F(BriefMapsTest, LostFramesAreLookedForFromWhatStays) {
  const FeatureWorld elsewhere(Ground(), 77);
  std::vector<SyntheticView> views;
  std::vector<SE3> poses;
  for (int i = kFirstBrief - 1; i <= kLastBrief; ++i) {
    views.push_back(elsewhere.View(PoseAt(i), kNoise, &random_));
    poses.push_back(PoseAt(i));
  }
  Map brief(kBrief);
  std::vector<LandmarkId> landmark_of;
  const auto keyframes = MapViews(std::span(views).subspan(1), std::span(poses).subspan(1),
                                  elsewhere.landmarks(), &brief, &atlas_.ids(), &landmark_of);
  atlas_.At(kBrief) = std::move(brief);
  for (size_t k = 0; k < keyframes.size(); ++k) {
    FrameRecord& record = records_[kFirstBrief + k];
    record.pose = {keyframes[k], SE3(), 1};
    record.features = views[k + 1].features;
  }
  FrameRecord lost;
  lost.id = records_[kFirstBrief - 1].id;
  lost.time = records_[kFirstBrief - 1].time;
  lost.features = views[0].features;
  records_[kFirstBrief - 1] = lost;
  EXPECT_EQ(Finish(10), 0);
  for (int i = kFirstBrief - 1; i <= kLastBrief; ++i) {
    EXPECT_EQ(records_[static_cast<size_t>(i)].map, kBrief) << i;
    EXPECT_LT(Error(i), 0.05) << i;
  }
}

TEST_F(BriefMapsTest, BothOfTwoInARowAreLookedFor) {
  const MapId second{2};
  Map next(second);
  const KeyframeId id = atlas_.ids().NextKeyframe();
  next.AddKeyframe(id, FrameAt(kLastBrief), BriefPoseAt(kLastBrief));
  atlas_.Add(std::move(next));
  records_[kLastBrief].map = second;
  records_[kLastBrief].pose = {id, SE3(), 1};
  EXPECT_EQ(Finish(kBriefS), 2);
  for (int i = kFirstBrief; i <= kLastBrief; ++i) {
    EXPECT_EQ(records_[static_cast<size_t>(i)].map, kAround) << i;
    EXPECT_LT(Error(i), 0.05) << i;
  }
}

TEST_F(BriefMapsTest, FramesOfOneThatBecameAPartOfAnotherGoBackToThat) {
  const MapId second{2};
  Map next(second);
  const KeyframeId id = atlas_.ids().NextKeyframe();
  next.AddKeyframe(id, FrameAt(kLastBrief), BriefPoseAt(kLastBrief));
  atlas_.Add(std::move(next));
  FrameRecord& joined = records_[kLastBrief];
  joined.map = second;
  joined.pose = {id, SE3(), 1};
  joined.features = std::make_shared<const Features>(
      RandomFeatures(300, 752, 480, FeatureWorld::kDimension, &random_));
  Mapper(world_.camera(), {}, &atlas_, nullptr)
      .Join({second, kBrief, Sim3(), {}, {{id, brief_keyframes_[0], {}}}});
  EXPECT_EQ(Finish(kBriefS), 0);
  EXPECT_EQ(joined.map, atlas_.Current(second));
}

TEST_F(BriefMapsTest, WhatIsPutBackIsAsItWas) {
  const std::vector<FrameRecord> before = records_;
  BriefMaps brief(&atlas_, {0}, kBriefS);
  brief.SetAside(&records_);
  EXPECT_FALSE(records_[kFirstBrief].located());
  brief.SetAside(&records_);  // twice, as after a failure, loses nothing
  brief.PutBack(&records_);
  for (size_t i = 0; i < records_.size(); ++i) {
    EXPECT_EQ(records_[i].map, before[i].map) << i;
    EXPECT_EQ(records_[i].pose.keyframe, before[i].pose.keyframe) << i;
    EXPECT_EQ(records_[i].features, before[i].features) << i;
    EXPECT_EQ(records_[i].seen.size(), before[i].seen.size()) << i;
  }
  EXPECT_EQ(Finish(kBriefS), 1) << "and it can be set aside again";
}

TEST_F(BriefMapsTest, OneThatHeldForLongerIsAMap) {
  EXPECT_EQ(Finish(0.01), 0);
  EXPECT_EQ(records_[kFirstBrief].map, kBrief);
}

TEST_F(BriefMapsTest, OneThatWasLoadedStays) {
  EXPECT_EQ(Finish(10, KeyframeId{brief_keyframes_.back().value + 1}), 0);
  EXPECT_EQ(records_[kFirstBrief].map, kBrief);
}

TEST_F(BriefMapsTest, OneBetweenTwoMapsStays) {
  Map last(MapId{2});
  const KeyframeId id = atlas_.ids().NextKeyframe();
  last.AddKeyframe(id, FrameAt(20), PoseAt(20));
  atlas_.Add(std::move(last));
  for (size_t i = kLastBrief + 1; i < records_.size(); ++i) {
    records_[i].map = MapId{2};
    records_[i].pose = {id, records_[i].cam_from_world * PoseAt(20).Inverse(), 1};
  }
  EXPECT_EQ(Finish(kBriefS), 0);
  EXPECT_EQ(records_[kFirstBrief].map, kBrief);
}

}  // namespace
}  // namespace deepuav
