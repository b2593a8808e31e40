#include "deepuav/system/shutter/image_turns.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/system/testing/shaken_flight.h"

namespace deepuav {
namespace {

class ImageTurnsTest : public testing::Test, protected ShakenFlight {
 protected:
  ImageTurns Measure(TurnModel model = TurnModel::kTurn,
                     const ImageTurnOptions& options = {}) const {
    const Map& map = atlas_.At(MapId{0});
    return MeasureImageTurns(
        atlas_, MapId{0}, records_,
        [&map](const FrameRecord& record) { return map.PoseOf(record.pose); }, camera_, model,
        options);
  }

  /// How the camera truly turned while it read the image, from the first row to the last.
  Eigen::Vector3d TrueTurn(int frame) const {
    const double half = kReadoutS / step_s_ / 2;
    const SE3 before = Shaken(frame - half), after = Shaken(frame + half);
    return (before * after.Inverse()).Log().tail<3>();
  }

  /// Root mean square of the turns, without the path's ends.
  double TurnError(const ImageTurns& turns) const {
    double squared = 0;
    for (int i = kEnd; i + kEnd < kFrames; ++i)
      squared += (turns.motions.at(TimeOf(i)).turn_rad - TrueTurn(i)).squaredNorm();
    return std::sqrt(squared / (kFrames - 2 * kEnd));
  }
  double Turned() const {
    double squared = 0;
    for (int i = kEnd; i + kEnd < kFrames; ++i) squared += TrueTurn(i).squaredNorm();
    return std::sqrt(squared / (kFrames - 2 * kEnd));
  }

  static constexpr int kEnd = 3;
};

TEST_F(ImageTurnsTest, TellWhatTheirPathDoesNot) {
  Fly(9, 0.1);
  const ImageTurns turns = Measure();
  EXPECT_EQ(turns.motions.size(), kFrames);
  EXPECT_GT(turns.saved_share, 0.5);
  EXPECT_TRUE(AreBelieved(turns, ImageTurnOptions().min_cost_share, {}));
  EXPECT_LT(TurnError(turns), 0.25 * Turned());
  // What is left is how the turn bends.
  EXPECT_LT(TurnError(Measure(TurnModel::kTurnAndBend)), 0.2 * Turned());
}

TEST_F(ImageTurnsTest, ChangeLittleOnceTheyAreKnown) {
  Fly(9, 0.1);
  ReadoutPath path = FindReadoutPath(atlas_, MapId{0}, records_, nullptr, kReadoutS, {});
  const ImageTurns turns = Measure(TurnModel::kTurnAndBend);
  TakeTurns(turns, &path);
  ChangeMotions(path, atlas_, MapId{0}, camera_, &records_);
  const ImageTurns again = Measure(TurnModel::kTurnAndBend);
  EXPECT_LT(again.changed_rad, 0.25 * turns.changed_rad);
  EXPECT_LT(TurnError(again), 0.2 * Turned());
}

TEST_F(ImageTurnsTest, CountAsMeasuredAndStay) {
  Fly(9, 0.1);
  records_[4].seen.resize(5);
  ReadoutPath path = FindReadoutPath(atlas_, MapId{0}, records_, nullptr, kReadoutS, {});
  const ImageTurns turns = Measure();
  TakeTurns(turns, &path);
  ChangeMotions(path, atlas_, MapId{0}, camera_, &records_);
  EXPECT_FALSE(HasMeasuredTurns(atlas_, MapId{0}, records_));
  MarkMeasured(turns, atlas_, MapId{0}, &records_);
  EXPECT_TRUE(HasMeasuredTurns(atlas_, MapId{0}, records_));
  EXPECT_FALSE(records_[4].turn_is_measured) << "it told nothing";
  ReadoutPath later = FindReadoutPath(atlas_, MapId{0}, records_, nullptr, kReadoutS, {});
  KeepMeasuredTurns(records_, &later);
  EXPECT_TRUE(later.motions.at(TimeOf(10)).TurnsAs(turns.motions.at(TimeOf(10))));
}

/// Where images come so rarely that the path's own slow turns are unknown.
TEST_F(ImageTurnsTest, AreNotAskedWhereNothingTellsTheSlowOnes) {
  Fly(9, 0.3);
  const ImageTurns turns = Measure();
  EXPECT_TRUE(turns.motions.empty() && turns.slow_motions.empty());
  EXPECT_FALSE(AreBelieved(turns, ImageTurnOptions().min_cost_share, {}));
}

TEST_F(ImageTurnsTest, AreNoneOnceARunIsStopped) {
  Fly(9, 0.1);
  int asked = 0;
  const Map& map = atlas_.At(MapId{0});
  const ImageTurns turns = MeasureImageTurns(
      atlas_, MapId{0}, records_,
      [&map](const FrameRecord& record) { return map.PoseOf(record.pose); }, camera_,
      TurnModel::kTurn, {}, [&asked] { return ++asked > 3; });
  EXPECT_EQ(asked, 4);
  EXPECT_TRUE(turns.motions.empty());
  EXPECT_FALSE(AreBelieved(turns, ImageTurnOptions().min_cost_share, {}));
}

TEST_F(ImageTurnsTest, AreNoiseOfACameraThatReadsAllRowsAtOnce) {
  row_readout_s_ = 0;
  noise_px_ = 0.3;
  Fly(9, 0.1);
  const ImageTurns turns = Measure();
  EXPECT_FALSE(AreBelieved(turns, ImageTurnOptions().min_cost_share, {}));
  EXPECT_NEAR(turns.changed_rad, turns.noise_rad, 0.3 * turns.noise_rad);
}

/// All images sheared alike may be a map that is sheared: their path knows better.
TEST_F(ImageTurnsTest, LeaveWhatAllHaveInCommonToThePath) {
  Fly(9, 0.1);
  const ImageTurns turns = Measure();
  ReadoutMotion common;
  common.turn_rad = {0.004, -0.003, 0.002};
  for (FrameRecord& record : records_) record.seen_motion.turn_rad += common.turn_rad;
  const ImageTurns sheared = Measure();
  for (const auto& [time, motion] : turns.motions) {
    const double moved = (sheared.motions.at(time).turn_rad - motion.turn_rad).norm();
    EXPECT_LT(moved, 0.05 * common.turn_rad.norm());
  }
}

TEST_F(ImageTurnsTest, OfFramesThatSeeTooLittleAreThePathsOwn) {
  Fly(9, 0.1);
  records_[10].seen.resize(5);
  const ImageTurns turns = Measure();
  EXPECT_FALSE(turns.motions.contains(records_[10].time));
  ASSERT_TRUE(turns.slow_motions.contains(records_[10].time));
  EXPECT_LT(turns.slow_motions.at(records_[10].time).turn_rad.norm(), 0.5 * Turned());
  EXPECT_LT((turns.motions.at(records_[12].time).turn_rad - TrueTurn(12)).norm(), 0.4 * Turned());
}

TEST_F(ImageTurnsTest, AreAskedOfLocatedFramesOfTheMapAlone) {
  Fly(9, 0.1);
  records_[4].map = MapId{};
  const ImageTurns turns = Measure();
  EXPECT_EQ(turns.motions.size(), kFrames - 1);
  for (FrameRecord& record : records_) record.map = MapId{};
  EXPECT_TRUE(Measure().motions.empty());
  EXPECT_EQ(Measure().saved_share, 0);
}

TEST_F(ImageTurnsTest, SomeInARowTellOfAll) {
  Fly(9, 0.1);
  ImageTurnOptions options;
  options.first_images = 20;
  options.first_stretch = 10;
  const std::vector<FrameRecord> first = FirstAsked(records_, options);
  ASSERT_EQ(first.size(), 20u);
  for (size_t i = 1; i < first.size(); ++i)
    EXPECT_EQ(first[i].id.value == first[i - 1].id.value + 1, i != 10) << i;
  const double saved = Measure().saved_share;
  records_ = first;
  EXPECT_NEAR(Measure().saved_share, saved, 0.1);
}

TEST_F(ImageTurnsTest, OfFewAllAreAskedAtOnce) {
  Fly(9, 0.1);
  for (const int count : {1, int(kFrames) - 1, int(kFrames)}) {
    ImageTurnOptions options;
    options.first_images = options.first_stretch = count;
    EXPECT_EQ(FirstAsked(records_, options).size(), size_t(count));
  }
  ImageTurnOptions longer;
  longer.first_stretch = 1'000'000;
  EXPECT_EQ(FirstAsked(records_, longer).size(), records_.size());
}

TEST_F(ImageTurnsTest, ChangeTurnsAlone) {
  Fly(9, 0.1);
  ReadoutPath path = FindReadoutPath(atlas_, MapId{0}, records_, nullptr, kReadoutS, {});
  const ReadoutPath before = path;
  const ImageTurns turns = Measure();
  TakeTurns(turns, &path);
  for (const auto& [time, motion] : path.motions) {
    EXPECT_TRUE(motion.TurnsAs(turns.motions.at(time)));
    EXPECT_EQ(motion.travel, before.motions.at(time).travel);
  }
}

}  // namespace
}  // namespace deepuav
