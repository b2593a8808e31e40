#include "deepuav/system/shutter/readout_path.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/mapping/camera/readout_change.h"
#include "deepuav/system/testing/shaken_flight.h"

namespace deepuav {
namespace {

class ReadoutPathTest : public testing::Test, protected ShakenFlight {
 protected:
  ReadoutPath Find(const ReadoutPathOptions& options = {}) const {
    return FindReadoutPath(atlas_, MapId{0}, records_, nullptr, kReadoutS, options);
  }
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
