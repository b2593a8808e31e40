#include "deepuav/io/geodata/map_origin.h"

#include <gtest/gtest.h>

#include "deepuav/io/testing/io_test_support.h"
#include "deepuav/io/testing/map_test_support.h"

namespace deepuav {
namespace {

/// Frames at given times.
class TimedDataset : public Dataset {
 public:
  explicit TimedDataset(std::vector<int64_t> times) : times_(std::move(times)) {}

  std::string Kind() const override { return "tum"; }
  const Camera& camera() const override { return camera_; }
  int size() const override { return static_cast<int>(times_.size()); }
  Timestamp Time(int frame) const override { return {times_.at(static_cast<size_t>(frame))}; }
  std::string Name(int frame) const override { return fmt::format("folder/rgb/{}.png", frame); }
  GreyImage Load(int /*frame*/) override { return {}; }
  cv::Mat3b LoadColour(int /*frame*/, const cv::Size& /*size*/) override { return {}; }

 private:
  const Camera camera_;
  std::vector<int64_t> times_;
};

std::map<KeyframeId, int64_t> KeyframeTimes(const Atlas& atlas) {
  std::map<KeyframeId, int64_t> times;
  for (const MapId id : atlas.Remaining()) {
    atlas.At(id).keyframes().ForEach(
        [&](const Keyframe& keyframe) { times[keyframe.id] = keyframe.frame.time.nanoseconds; });
  }
  return times;
}

TEST(NameImages, ByTime) {
  Atlas atlas;
  atlas.Add(TestMap(atlas.NextMap(), 9, 4, 4, 1, &atlas.ids()));
  const std::map<KeyframeId, int64_t> times = KeyframeTimes(atlas);
  const int64_t first = times.begin()->second, last = times.rbegin()->second;
  // Every other frame became no keyframe; the last keyframe's image is not there.
  std::vector<int64_t> frames;
  std::map<KeyframeId, std::string> expected;
  for (const auto& [keyframe, time] : times) {
    if (time == last) continue;
    frames.push_back(time - 1);
    expected[keyframe] = fmt::format("{}.png", frames.size());
    frames.push_back(time);
  }
  std::map<KeyframeId, std::string> names;
  NameImages(atlas, TimedDataset(frames), &names);
  EXPECT_EQ(names, expected);
  EXPECT_EQ(names.size(), times.size() - 1);

  NameImages(atlas, TimedDataset({first, last}), &names);
  expected[times.rbegin()->first] = "1.png";
  EXPECT_EQ(names, expected) << "names that are there stay";
}

TEST(NameImages, InAnEmptyDataset) {
  Atlas atlas;
  atlas.Add(TestMap(atlas.NextMap(), 2, 4, 4, 1, &atlas.ids()));
  std::map<KeyframeId, std::string> names;
  NameImages(atlas, TimedDataset({}), &names);
  EXPECT_TRUE(names.empty());
}

TEST(ImageName, LeavesTheFoldersOut) { EXPECT_EQ(TimedDataset({1, 2}).ImageName(1), "1.png"); }

}  // namespace
}  // namespace deepuav
