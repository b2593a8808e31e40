#include "deepuav/system/frames/record_limits.h"

#include <gmock/gmock.h>

#include <algorithm>

namespace deepuav {
namespace {

using testing::ElementsAre;

FrameRecord Located(int64_t id, int landmarks) {
  FrameRecord record;
  record.id = {id};
  record.time = Timestamp{id * 100'000'000};
  record.map = {0};
  record.landmark_count = landmarks;
  record.seen.resize(static_cast<size_t>(landmarks));
  record.features = std::make_shared<const Features>();
  return record;
}

RecordLimits Limits() {
  return {.min_neighbour_share = 0.5,
          .max_unlocated_frames = 4,
          .young_map_frames = 0,
          .max_brief_s = 0,
          .full_record_frames = 3,
          .old_record_landmarks = 2,
          .max_records = 0};
}

std::vector<int64_t> Ids(const std::vector<FrameRecord>& records) {
  std::vector<int64_t> ids;
  for (const FrameRecord& record : records) ids.push_back(record.id.value);
  return ids;
}

std::vector<int64_t> IdsWithFeatures(const std::vector<FrameRecord>& records) {
  std::vector<int64_t> ids;
  for (const FrameRecord& record : records) {
    if (record.features) ids.push_back(record.id.value);
  }
  return ids;
}

TEST(RecordKeeper, LetsGoOfTheFeaturesOfSureFrames) {
  RecordKeeper keeper(Limits());
  std::vector<FrameRecord> records;
  for (int64_t id = 0; id < 6; ++id) {
    records.push_back(Located(id, id == 2 ? 3 : 10));
    keeper.Limit(&records);
  }
  keeper.End(&records);
  for (const FrameRecord& record : records)
    EXPECT_EQ(record.features != nullptr, record.id.value == 2) << record.id.value;
  EXPECT_EQ(records[1].seen.size(), 2u);
  EXPECT_EQ(records[3].seen.size(), 10u);
  EXPECT_EQ(keeper.forgotten(), 0);
}

TEST(RecordKeeper, KeepsTheFeaturesOfTheFirstFramesOfEachMap) {
  RecordLimits limits = Limits();
  limits.young_map_frames = 2;
  limits.max_unlocated_frames = 100;
  RecordKeeper keeper(limits);
  std::vector<FrameRecord> records;
  for (int64_t id = 0; id < 12; ++id) {
    records.push_back(Located(id, 10));
    if (id < 1) records.back().map = {};
    if (id >= 6) records.back().map = {1};
    keeper.Limit(&records);
  }
  keeper.End(&records);
  EXPECT_THAT(IdsWithFeatures(records), ElementsAre(0, 1, 2, 6, 7))
      << "the one without a pose, and two a map";
}

TEST(RecordKeeper, KeepsTheFeaturesOfAMapThatMayBeABriefOneUntilItIsNot) {
  RecordLimits limits = Limits();
  limits.max_brief_s = 0.45;
  limits.max_unlocated_frames = 100;
  RecordKeeper keeper(limits);
  std::vector<FrameRecord> records;
  for (int64_t id = 0; id < 12; ++id) {
    records.push_back(Located(id, 10));
    if (id == 4) records.back().map = {};
    if (id > 4) records.back().map = {1};
    keeper.Limit(&records);
    if (id == 8) {
      EXPECT_TRUE(records[6].features) << "so far it has lasted for 0.3 s";
    }
  }
  keeper.End(&records);
  EXPECT_THAT(IdsWithFeatures(records), ElementsAre(0, 1, 2, 3, 4, 5));
  for (const int64_t id : {0, 1, 2, 3, 5})
    EXPECT_EQ(records[static_cast<size_t>(id)].is_sure, id < 3) << id << ": beside the lost one";
}

TEST(RecordKeeper, KeepsAllOfAMapThatIsABriefOneWhenTheRunEnds) {
  RecordLimits limits = Limits();
  limits.max_brief_s = 10;
  limits.max_unlocated_frames = 100;
  RecordKeeper keeper(limits);
  std::vector<FrameRecord> records;
  for (int64_t id = 0; id < 4; ++id) {
    records.push_back(Located(id, 10));
    keeper.Limit(&records);
  }
  keeper.End(&records);
  EXPECT_THAT(IdsWithFeatures(records), ElementsAre(0, 1, 2, 3));
}

TEST(RecordKeeper, LetsGoOfSureFramesBeforeLostOnes) {
  RecordLimits limits = Limits();
  limits.max_brief_s = 10;
  RecordKeeper keeper(limits);
  std::vector<FrameRecord> records;
  for (int64_t id = 0; id < 10; ++id) {
    records.push_back(Located(id, 10));
    if (id < 2) records.back().map = {};
    keeper.Limit(&records);
  }
  keeper.End(&records);
  EXPECT_THAT(IdsWithFeatures(records), ElementsAre(0, 1, 2, 9)) << "2 is beside a lost one";
}

TEST(RecordKeeper, ForgetsEverySecondOfTheOlderHalf) {
  RecordLimits limits = Limits();
  limits.max_records = 8;
  RecordKeeper keeper(limits);
  std::vector<FrameRecord> records;
  for (int64_t id = 0; id < 9; ++id) {
    records.push_back(Located(id, 10));
    keeper.Limit(&records);
  }
  EXPECT_THAT(Ids(records), ElementsAre(0, 2, 4, 5, 6, 7, 8));
  EXPECT_EQ(keeper.forgotten(), 2);
}

TEST(RecordKeeper, StaysSmallWhateverComes) {
  RecordLimits limits = Limits();
  limits.max_records = 20;
  limits.max_unlocated_frames = 1000;
  RecordKeeper keeper(limits);
  std::vector<FrameRecord> records;
  constexpr int64_t kFrames = 5000;
  for (int64_t id = 0; id < kFrames; ++id) {
    records.push_back(Located(id, id % 5 == 0 ? 1 : 10));  // Every fifth is doubtful.
    keeper.Limit(&records);
    ASSERT_LE(records.size(), 20u);
  }
  EXPECT_EQ(static_cast<int64_t>(records.size()) + keeper.forgotten(), kFrames);
  EXPECT_TRUE(std::is_sorted(records.begin(), records.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));
  EXPECT_EQ(records.back().id.value, kFrames - 1);
  // Features stay where a neighbour can still locate the frame, and are those of doubtful frames.
  int with_features = 0;
  for (const FrameRecord& record : records) {
    if (record.id.value == kFrames - 1 || !record.features) continue;
    EXPECT_EQ(record.id.value % 5, 0);
    ++with_features;
  }
  EXPECT_GT(with_features, 0);
  EXPECT_LT(with_features, 20);
}

}  // namespace
}  // namespace deepuav
