#include "deepuav/viewer/view_model.h"

#include <gmock/gmock.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "deepuav/viewer/view_messages.h"
#include "deepuav/viewer/view_test_support.h"

namespace deepuav {
namespace {

FrameView Picture(int64_t id) {
  FrameView frame;
  frame.id = {id};
  frame.state = "tracked";
  frame.world_from_cam = SE3();
  frame.image = GreyImage::zeros(48, 64);
  frame.width_px = 64;
  frame.height_px = 48;
  frame.landmarks_px = {{32, 24}, {-5, 100}};
  return frame;
}

/// All that the client has not got.
std::vector<ViewMessage> All(const ViewModel& model, ViewCursor* cursor) {
  std::vector<ViewMessage> messages;
  while (auto message = model.Next(cursor)) messages.push_back(*message);
  return messages;
}

void RefreshLater(ViewModel* model) {
  std::this_thread::sleep_for(std::chrono::milliseconds(110));
  model->Refresh();
}

TEST(ViewModel, GivesTheNewestOnceToEach) {
  ViewModel model("flight");
  model.CountWatchers(+1);
  for (int64_t id : {1, 2, 3}) model.SetFrame(Picture(id));
  model.AddEvent("map 0 starts");
  RefreshLater(&model);
  ViewCursor first, second;
  const auto messages = All(model, &first);
  ASSERT_EQ(messages.size(), 3u);  // The event, the status, the picture.
  EXPECT_TRUE(messages[0].is_text);
  EXPECT_EQ(nlohmann::json::parse(*messages[0].bytes)["lines"][0], "map 0 starts");
  const auto status = nlohmann::json::parse(*messages[1].bytes);
  EXPECT_EQ(status["frame"], 3);
  EXPECT_EQ(status["pose"].size(), 7u);
  EXPECT_FALSE(messages[2].is_text);
  EXPECT_EQ(HeaderOf(*messages[2].bytes)["frame"], 3);
  EXPECT_TRUE(All(model, &first).empty());
  EXPECT_EQ(All(model, &second).size(), 3u);
}

TEST(ViewModel, DoesNothingUnlessWatched) {
  ViewModel model("flight");
  model.SetFrame(Picture(1));
  RefreshLater(&model);
  ViewCursor cursor;
  EXPECT_TRUE(All(model, &cursor).empty());
}

TEST(ViewModel, TellsOfItsOwnMemoryOrOfARecordedRuns) {
  ViewModel model("flight");
  model.CountWatchers(+1);
  ViewCursor cursor;
  model.Refresh(true);
  auto status = JsonOf(*model.Next(&cursor));
  EXPECT_GT(status["memory_mb"], 1);
  EXPECT_EQ(status["memory_is_peak"], false);
  model.SetPeakMemory(0.5);
  model.Refresh(true);
  status = JsonOf(*model.Next(&cursor));
  EXPECT_EQ(status["memory_mb"], 0.5);
  EXPECT_EQ(status["memory_is_peak"], true);
}

TEST(ViewModel, KeepsTheLatestEvents) {
  ViewModel model("flight");
  for (int i = 0; i < 1000; ++i) model.AddEvent(std::to_string(i));
  ViewCursor cursor;
  const auto messages = All(model, &cursor);
  ASSERT_EQ(messages.size(), 1u);
  const auto lines = nlohmann::json::parse(*messages[0].bytes)["lines"];
  EXPECT_EQ(lines.size(), 100u);
  EXPECT_EQ(lines.back(), "999");
}

TEST(ViewModel, ASlowClientGetsEveryTopic) {
  ViewModel model("flight");
  model.CountWatchers(+1);
  ViewCursor cursor;
  std::set<std::string> kinds;
  for (int64_t id = 0; id < 3; ++id) {  // One message each time that all topics are new.
    model.SetFrame(Picture(id));
    model.SetMap({});
    RefreshLater(&model);
    const auto message = model.Next(&cursor);
    ASSERT_TRUE(message);
    kinds.insert(JsonOf(*message)["kind"].get<std::string>());
  }
  EXPECT_THAT(kinds, testing::ElementsAre("map", "picture", "status"));
}

TEST(ViewMessages, APictureHoldsSharesAndAJpeg) {
  const std::string bytes = PictureMessage(Picture(7));
  const auto header = HeaderOf(bytes);
  EXPECT_EQ(header["points"], 2);
  const size_t body = sizeof(uint32_t) + header.dump().size();
  uint16_t shares[4];
  std::memcpy(shares, bytes.data() + body, sizeof(shares));
  EXPECT_THAT(shares, testing::ElementsAre(32768, 32768, 0, 65535));
  EXPECT_EQ(bytes.substr(body + sizeof(shares), 2), "\xff\xd8");
}

TEST(ViewMessages, AMapHoldsWhatItsHeaderCounts) {
  MapView map;
  map.map = 2;
  map.points = {{0, 0, 1}, {2, 0, 1}};
  map.world_from_keyframes = {SE3()};
  map.path = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  map.loops = {{Eigen::Vector3f(0, 1, 2), Eigen::Vector3f(3, 4, 5)}};
  map.up = {0, 0, 1};
  const std::string bytes = MapMessage(map);
  const auto header = HeaderOf(bytes);
  EXPECT_EQ(header["size"], (nlohmann::json{2, 0, 0}));
  EXPECT_EQ(header["up"], (nlohmann::json{0, 0, 1}));
  EXPECT_EQ(header["loops"], 1);
  const size_t floats = sizeof(uint32_t) + header.dump().size() + 2 * 3 * 2;
  EXPECT_EQ(bytes.size(), floats + (7 + 3 * 3 + 2 * 3) * sizeof(float));
  float ends[6];
  std::memcpy(ends, bytes.data() + bytes.size() - sizeof(ends), sizeof(ends));
  EXPECT_THAT(ends, testing::ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_EQ(HeaderOf(MapMessage({}))["points"], 0);
}

}  // namespace
}  // namespace deepuav
