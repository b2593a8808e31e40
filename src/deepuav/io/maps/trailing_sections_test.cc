#include "deepuav/io/maps/trailing_sections.h"

#include <gmock/gmock.h>

#include <limits>
#include <span>
#include <vector>

#include "deepuav/io/maps/map_file.h"
#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/io/testing/map_test_support.h"

namespace deepuav {
namespace {

using testing::HasSubstr;

class TrailingSectionsTest : public ::testing::Test {
 protected:
  void WriteAtlas(const Atlas& atlas) {
    WriteMapFile(file_, atlas, TestMapCamera(), TestMapOrigin());
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "map.deepuav";
};

TEST_F(TrailingSectionsTest, KeepsThePlaceOnEarth) {
  Atlas atlas = TestAtlas(20, 30, 64, 1);
  WriteAtlas(atlas);
  EXPECT_EQ(ReadMapFile(file_).atlas.GaugeOf(MapId{0}).kind, GaugeKind::kFree);
  atlas.ChangeGauge(MapId{0}, Sim3(), {GaugeKind::kGeoreferenced, {47.5, 8.25, 431}, 0.01});
  WriteAtlas(atlas);
  const Gauge gauge = ReadMapFile(file_).atlas.GaugeOf(MapId{0});
  EXPECT_EQ(gauge.kind, GaugeKind::kGeoreferenced);
  EXPECT_EQ(gauge.origin.latitude_deg, 47.5);
  EXPECT_EQ(gauge.origin.altitude_m, 431);
  EXPECT_EQ(gauge.scale_sigma, 0.01);
}

TEST_F(TrailingSectionsTest, KeepsThatAMapIsMetric) {
  Atlas atlas = TestAtlas(20, 30, 64, 1);
  atlas.ChangeGauge(MapId{0}, Sim3(), {GaugeKind::kMetric, {}, 0.004});
  WriteAtlas(atlas);
  const Gauge gauge = ReadMapFile(file_).atlas.GaugeOf(MapId{0});
  EXPECT_EQ(gauge.kind, GaugeKind::kMetric);
  EXPECT_EQ(gauge.scale_sigma, 0.004);
}

TEST_F(TrailingSectionsTest, KeepsHowCamerasMovedWhileKeyframesWereRead) {
  Atlas atlas = TestAtlas(20, 30, 64, 1);
  const ReadoutMotion motion{{0.01, -0.02, 0.003}, {0.1, 0.2, -0.3}, {0.002, 0, -0.001}};
  const KeyframeId moved = atlas.At(MapId{0}).root();
  atlas.At(MapId{0}).SetMotion(moved, motion);
  WriteAtlas(atlas);
  const LoadedAtlas loaded = ReadMapFile(file_);
  int others = 0;
  loaded.atlas.At(MapId{0}).keyframes().ForEach([&](const Keyframe& keyframe) {
    const ReadoutMotion& read = keyframe.frame.motion;
    if (keyframe.id == moved) {
      EXPECT_TRUE(read.TurnsAs(motion));
      EXPECT_EQ(read.travel, motion.travel);
    } else {
      EXPECT_TRUE(read.IsNone());
      ++others;
    }
  });
  EXPECT_GT(others, 0);
}

std::string Written(const std::vector<std::pair<KeyframeId, ReadoutMotion>>& motions) {
  ByteWriter writer;
  for (const auto& motion : motions) PutMotions({motion}, &writer);
  // Each was written with a count of one.
  std::string bytes = writer.bytes();
  std::string all;
  ByteWriter count;
  count.Put<uint64_t>(motions.size());
  all = count.bytes();
  const size_t each = bytes.size() / motions.size();
  for (size_t i = 0; i < motions.size(); ++i) all += bytes.substr(i * each + 8, each - 8);
  return all;
}

TEST(Motions, OfOlderFilesTurnSteadily) {
  ByteWriter writer;
  writer.Put<uint64_t>(2);
  for (const int64_t keyframe : {3, 5}) {
    writer.Put<int64_t>(keyframe);
    writer.PutAll(std::span<const double>(std::vector<double>{0.1, 0.2, 0.3, 1, 2, 3}));
  }
  const auto motions = GetMotions(writer.bytes(), false);
  ASSERT_EQ(motions.size(), 2u);
  const ReadoutMotion& read = motions.at(KeyframeId{5});
  EXPECT_TRUE(read.TurnsAs({{0.1, 0.2, 0.3}, {0, 0, 0}, {0, 0, 0}}));
  EXPECT_EQ(read.travel, Eigen::Vector3d(1, 2, 3));
}

TEST(Motions, OnesThatCannotBeAreRefused) {
  const ReadoutMotion still{{0.1, 0, 0}, {0, 0, 1}};
  EXPECT_EQ(GetMotions(Written({{KeyframeId{3}, still}, {KeyframeId{5}, still}})).size(), 2u);
  EXPECT_THAT(ErrorOf([&] {
                GetMotions(Written({{KeyframeId{3}, still}, {KeyframeId{3}, still}}));
              }),
              HasSubstr("keyframe 3 moved twice: expected once"));
  EXPECT_THAT(ErrorOf([] {
                GetMotions(Written({{KeyframeId{4}, {{4, 0, 0}, {0, 0, 0}}}}));
              }),
              HasSubstr("keyframe 4 turned by 4 rad while it was read: expected at most 3.2"));
  EXPECT_THAT(ErrorOf([] {
                GetMotions(Written({{KeyframeId{4}, {{0, 0, 0}, {0, 0, 0}, {0, 5, 0}}}}));
              }),
              HasSubstr("keyframe 4 turned by 5 rad while it was read: expected at most 3.2"));
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_THAT(ErrorOf([&] {
                GetMotions(Written({{KeyframeId{4}, {{0, 0, 0}, {infinite, 0, 0}}}}));
              }),
              HasSubstr("keyframe 4"));
}

}  // namespace
}  // namespace deepuav
