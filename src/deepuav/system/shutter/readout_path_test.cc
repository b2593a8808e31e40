#include "deepuav/system/shutter/readout_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "deepuav/base/error.h"
#include "deepuav/mapping/readout_change.h"
#include "support/straight_flight.h"

namespace deepuav {
namespace {

constexpr double kReadoutS = 0.02;

/// A map and records of a camera that shakes while its rows are read one after the other, both
/// with all true but for where the rows' own cameras saw the landmarks.
class ReadoutPathTest : public testing::Test, protected StraightFlight {
 protected:
  void Fly(double shaking_hz, double step_s) {
    shaking_hz_ = shaking_hz;
    step_s_ = step_s;
    camera_.readout_s = kReadoutS;
    std::vector<SE3> poses;
    std::vector<SyntheticView> views;
    for (int k = 0; k < kFrames; k += kFramesAKeyframe) {
      poses.push_back(Shaken(k));
      views.push_back(ReadByRows(k));
    }
    Map map(MapId{0});
    IdSource ids;
    keyframes_ = MapViews(views, poses, world_.landmarks(), &map, &ids, &landmark_of_);
    for (size_t k = 0; k < keyframes_.size(); ++k) {
      Frame frame = map.At(keyframes_[k]).frame;
      frame.id = FrameId{static_cast<int64_t>(k) * kFramesAKeyframe};
      frame.time = TimeOf(static_cast<double>(frame.id.value));
      map.SetFrame(keyframes_[k], frame);
    }
    atlas_.Add(std::move(map));
    for (int i = 0; i < kFrames; ++i) records_.push_back(Tracked(i));
  }

  /// About all axes, at frequencies from half of the given one on.
  SE3 Shaken(double frame) const {
    Eigen::Vector3d shake = Eigen::Vector3d::Zero();
    for (int k = 0; k < 6; ++k) {
      const double phase = 2 * std::numbers::pi * (1 - 0.1 * k) * shaking_hz_ * frame * step_s_;
      shake += 0.008 * Eigen::Vector3d(std::sin(phase + k), std::cos(phase), std::sin(phase - k));
    }
    return SE3(RotationExp(shake), Eigen::Vector3d::Zero()) * PoseAt(frame);
  }

  Timestamp TimeOf(double frame) const {
    return {static_cast<int64_t>(std::llround(1e9 * frame * step_s_))};
  }

  /// The image, in whose every row another camera saw what it shows.
  SyntheticView ReadByRows(int frame) {
    SyntheticView view = world_.View(Shaken(frame), {}, &random_);
    Features features = *view.features;
    for (size_t i = 0; i < features.keypoints.size(); ++i) {
      Keypoint& keypoint = features.keypoints[i];
      const Eigen::Vector3d& point = world_.landmarks()[static_cast<size_t>(view.landmark[i])];
      for (int round = 0; round < 4; ++round) {
        const double moment = RowMoment(keypoint.px.y(), camera_.height);
        const SE3 row_from_world = Shaken(frame + moment * kReadoutS / step_s_);
        keypoint.px = camera_.pinhole.Project(row_from_world * point).cast<float>();
      }
      keypoint.image_px = keypoint.px;
    }
    view.features = std::make_shared<const Features>(features);
    return view;
  }

  FrameRecord Tracked(int i) {
    const SyntheticView view = ReadByRows(i);
    FrameRecord record;
    record.id = FrameId{i};
    record.time = TimeOf(i);
    record.map = MapId{0};
    const Keyframe& near = atlas_.At(record.map).At(keyframes_[KeyframeOf(i)]);
    record.pose = {near.id, Shaken(i) * near.cam_from_world.Inverse(), 1};
    record.features = view.features;
    for (size_t k = 0; k < view.landmark.size(); ++k) {
      const LandmarkId landmark = landmark_of_[static_cast<size_t>(view.landmark[k])];
      if (landmark.valid())
        record.seen.push_back({landmark, {view.features->keypoints[k].px, 0.3F}});
    }
    return record;
  }

  ReadoutPath Find(const ReadoutPathOptions& options = {}) const {
    return FindReadoutPath(atlas_, MapId{0}, records_, nullptr, kReadoutS, options);
  }

  /// Root mean square, of where the middle row would have seen it.
  double ErrorPx(const FrameRecord& record) const {
    double squared = 0;
    const Map& map = atlas_.At(MapId{0});
    for (const FrameRecord::Seen& seen : record.seen)
      squared += SquaredErrorPx(map.PoseOf(record.pose), seen.landmark, seen.measured);
    return std::sqrt(squared / static_cast<double>(record.seen.size()));
  }
  double ErrorPx(const Keyframe& keyframe) const {
    double squared = 0;
    int count = 0;
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (!landmark.valid()) continue;
      const auto& observations = atlas_.At(MapId{0}).At(landmark).observations;
      const Observation& seen =
          *std::ranges::find(observations, keyframe.id, &Observation::keyframe);
      squared += SquaredErrorPx(keyframe.cam_from_world, landmark, seen.measured);
      ++count;
    }
    return std::sqrt(squared / count);
  }
  double SquaredErrorPx(const SE3& cam_from_world, LandmarkId landmark,
                        const PixelMeasurement& measured) const {
    const Eigen::Vector3d point = cam_from_world * atlas_.At(MapId{0}).At(landmark).position_world;
    return (camera_.pinhole.Project(point) - measured.px.cast<double>()).squaredNorm();
  }

  const FeatureWorld world_{Ground(), 2};
  Camera camera_ = world_.camera();
  double shaking_hz_ = 0, step_s_ = 0;
  Random random_{3};
  Atlas atlas_;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmark_of_;
  std::vector<FrameRecord> records_;
};

TEST_F(ReadoutPathTest, PutsWhatFramesSawWhereTheMiddleRowWouldSeeIt) {
  Fly(2, 0.05);
  const ReadoutPath path = Find();
  EXPECT_TRUE(path.tells_turns);
  EXPECT_EQ(path.motions.size(), kFrames);
  std::vector<FrameRecord> records = records_;
  ChangeMotions(path, atlas_, MapId{0}, camera_, &records);
  for (size_t i = 5; i + 5 < records.size(); ++i) {
    EXPECT_GT(ErrorPx(records_[i]), 0.3) << i;
    EXPECT_LT(ErrorPx(records[i]), 0.05) << i;
    EXPECT_NE(records[i].features->keypoints[0].px, records_[i].features->keypoints[0].px);
    EXPECT_TRUE(records[i].seen_motion.TurnsAs(records[i].motion));
  }
  EXPECT_LT(ErrorPx(records[0]), 0.5 * ErrorPx(records_[0]));
}

TEST_F(ReadoutPathTest, PutsWhatKeyframesSawThereToo) {
  Fly(2, 0.05);
  Map& map = atlas_.At(MapId{0});
  const auto motions = MotionsOfKeyframes(Find(), map, keyframes_[2]);
  EXPECT_FALSE(motions.contains(keyframes_[1])) << "of an earlier run";
  ChangeMotions(motions, camera_, &map);
  EXPECT_GT(ErrorPx(map.At(keyframes_[1])), 0.3);
  for (size_t k = 2; k + 1 < keyframes_.size(); ++k)
    EXPECT_LT(ErrorPx(map.At(keyframes_[k])), 0.05);
}

TEST_F(ReadoutPathTest, KeepsToTheUnitsOfAMapThatGrew) {
  Fly(2, 0.05);
  atlas_.At(MapId{0}).Rescale(3);
  ChangeMotions(Find(), atlas_, MapId{0}, camera_, &records_);
  EXPECT_LT(ErrorPx(records_[10]), 0.05);
  // Again from there, nothing changes.
  const Eigen::Vector2f px = records_[10].seen[0].measured.px;
  ChangeMotions(Find(), atlas_, MapId{0}, camera_, &records_);
  EXPECT_LT((records_[10].seen[0].measured.px - px).norm(), 5e-3F);
}

TEST_F(ReadoutPathTest, LeavesATurnThatAGyroscopeMeasured) {
  Fly(2, 0.05);
  const ReadoutMotion measured{{0.01, 0, 0}, {0, 0, 0}, {0, 0.001, 0}};
  records_[10].turn_is_measured = true;
  records_[10].motion = records_[10].seen_motion = measured;
  const auto features = records_[10].features;
  ReadoutPath path = Find();
  KeepMeasuredTurns(records_, &path);
  ChangeMotions(path, atlas_, MapId{0}, camera_, &records_);
  EXPECT_TRUE(records_[10].seen_motion.TurnsAs(measured));
  EXPECT_FALSE(records_[10].seen_motion.travel.isZero(0));
  EXPECT_EQ(records_[10].features, features);
}

TEST_F(ReadoutPathTest, TakesNoTurnOfACameraThatShakesFasterThanItsImagesCome) {
  Fly(9, 0.1);
  const ReadoutPath path = Find();
  EXPECT_FALSE(path.tells_turns);
  ASSERT_FALSE(path.motions.empty());
  for (const auto& [time, motion] : path.motions) {
    EXPECT_TRUE(motion.turn_rad.isZero(0));
    EXPECT_TRUE(motion.bend_rad.isZero(0));
    EXPECT_FALSE(motion.travel.isZero(0));
  }
}

TEST_F(ReadoutPathTest, TakesTheTurnsOfACameraThatHardlyTurns) {
  Fly(9, 0.1);
  ReadoutPathOptions options;
  options.harmless_rad = 0.001;
  EXPECT_FALSE(Find(options).tells_turns);
  options.harmless_rad = 0.1;
  EXPECT_TRUE(Find(options).tells_turns);
}

TEST(ReadoutPathOptions, OutOfRangeAreRefused) {
  ReadoutPathOptions options;
  EXPECT_NO_THROW(options.Check());
  options.path.reach = 0;
  EXPECT_THROW(options.Check(), Error);
  options = {};
  options.rounds = -1;
  EXPECT_THROW(options.Check(), Error);
}

}  // namespace
}  // namespace deepuav
