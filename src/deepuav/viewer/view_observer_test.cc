#include "deepuav/viewer/view_observer.h"

#include <gmock/gmock.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "deepuav/viewer/view_test_support.h"

namespace deepuav {
namespace {

/// The texts that the page is sent from here on.
std::vector<nlohmann::json> TextsAfter(ViewModel* model, ViewCursor* cursor) {
  std::this_thread::sleep_for(
      std::chrono::milliseconds(600));  // A status is due where no frame comes.
  model->Refresh();
  std::vector<nlohmann::json> texts;
  while (const auto message = model->Next(cursor)) {
    if (message->is_text) texts.push_back(nlohmann::json::parse(*message->bytes));
  }
  return texts;
}

TEST(ViewObserver, ForgetsWhatWasBeforeARunBeginsAnew) {
  ViewModel model("flight");
  model.CountWatchers(+1);
  ViewObserver observer(Camera{}, &model);
  observer.OnMap({MapChange::kStarted, MapId{0}, MapId{0}});
  observer.OnMap({MapChange::kLoopClosed, MapId{0}, MapId{0}});
  ViewCursor cursor;
  auto texts = TextsAfter(&model, &cursor);
  ASSERT_EQ(texts.size(), 2u);  // The events, the status.
  EXPECT_EQ(texts[1]["closed_loops"], 1);
  observer.OnRestart();
  texts = TextsAfter(&model, &cursor);
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_THAT(texts[0]["lines"].back().get<std::string>(), testing::HasSubstr("begins anew"));
  EXPECT_EQ(texts[1]["closed_loops"], 0);
}

/// What the page is sent of a map.
nlohmann::json ShownOf(const Map& map, ViewObserver* observer, ViewModel* model) {
  observer->OnMap({MapChange::kAdjusted, map.id(), map.id()});  // Shown at once.
  observer->OnMapState(map);
  model->Refresh();
  nlohmann::json shown;
  ViewCursor cursor;
  while (const auto message = model->Next(&cursor)) {
    if (!message->is_text) shown = JsonOf(*message);
  }
  return shown;
}

TEST(ViewObserver, TellsWhichWayAMapIsUp) {
  ViewModel model("flight");
  model.CountWatchers(+1);
  ViewObserver observer(Camera{}, &model);
  const nlohmann::json down_is_y = {0, -1, 0}, up_is_z = {0, 0, 1};
  EXPECT_EQ(ShownOf(Map(MapId{0}), &observer, &model)["up"], down_is_y);
  observer.OnGauge(MapId{0}, 0, {GaugeKind::kMetric, {}, 0.01});
  EXPECT_EQ(ShownOf(Map(MapId{0}), &observer, &model)["up"], up_is_z);
  EXPECT_EQ(ShownOf(Map(MapId{1}), &observer, &model)["up"], down_is_y);
  observer.OnRestart();
  EXPECT_EQ(ShownOf(Map(MapId{0}), &observer, &model)["up"], down_is_y);
}

}  // namespace
}  // namespace deepuav
