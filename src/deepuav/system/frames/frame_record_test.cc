#include "deepuav/system/frames/frame_record.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

FrameRecord Seeing(int landmarks) {
  FrameRecord record;
  record.map = MapId{0};
  record.landmark_count = landmarks;
  for (int i = 0; i < landmarks; ++i) record.seen.push_back({LandmarkId{i}, {}});
  return record;
}

TEST(Thin, KeepsSomeOfEachPart) {
  FrameRecord record = Seeing(500);
  Thin(80, &record);
  ASSERT_EQ(record.seen.size(), 80u);
  EXPECT_EQ(record.seen.capacity(), 80u) << "the memory is given back";
  EXPECT_EQ(record.landmark_count, 500);
  EXPECT_EQ(record.seen.front().landmark, LandmarkId{0});
  for (size_t i = 1; i < record.seen.size(); ++i) {
    const int64_t step = record.seen[i].landmark.value - record.seen[i - 1].landmark.value;
    EXPECT_GE(step, 6);
    EXPECT_LE(step, 7);
  }
}

TEST(Thin, LeavesFewAlone) {
  for (int landmarks : {0, 1, 80}) {
    FrameRecord record = Seeing(landmarks);
    Thin(80, &record);
    EXPECT_EQ(record.seen.size(), static_cast<size_t>(landmarks));
  }
  FrameRecord record = Seeing(5);
  Thin(0, &record);
  EXPECT_TRUE(record.seen.empty());
}

TEST(SeesLittle, ComparesWithTheNeighbourThatSeesMost) {
  const auto little = [](std::vector<int> landmarks, size_t i) {
    std::vector<FrameRecord> records;
    for (int count : landmarks) records.push_back(Seeing(count));
    return SeesLittle(records, i, 0.6);
  };
  for (const auto& [before, after] : {std::pair{200, 90}, {90, 200}}) {
    EXPECT_TRUE(little({before, 119, after}, 1));
    EXPECT_FALSE(little({before, 120, after}, 1));
  }
  EXPECT_FALSE(little({0, 30, 0}, 1));
  EXPECT_TRUE(little({119, 200}, 0));
  EXPECT_FALSE(little({120, 200}, 0));
  EXPECT_TRUE(little({200, 119}, 1));
  EXPECT_FALSE(little({200, 120}, 1));
  EXPECT_FALSE(little({30}, 0));
  EXPECT_TRUE(SeesLittle({FrameRecord()}, 0, 0.6)) << "has no pose";
}

TEST(SeesLittle, DoubtsFramesBesideLostOnes) {
  const std::vector<FrameRecord> records = {Seeing(100), Seeing(100), FrameRecord(), Seeing(100),
                                            Seeing(100)};
  const auto little = [&](size_t i) { return SeesLittle(records, i, 0.6); };
  EXPECT_FALSE(little(0));
  EXPECT_TRUE(little(1));
  EXPECT_TRUE(little(3)) << "recognised without a neighbour's help";
  EXPECT_FALSE(little(4));
}

}  // namespace
}  // namespace deepuav
