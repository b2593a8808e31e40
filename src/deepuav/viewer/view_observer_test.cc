#include "deepuav/viewer/view_observer.h"

#include <gmock/gmock.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

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

}  // namespace
}  // namespace deepuav
