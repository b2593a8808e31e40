#include "deepuav/api/event_queue.h"

#include <gmock/gmock.h>

#include <future>
#include <semaphore>
#include <stdexcept>

namespace deepuav::api {
namespace {

using ::testing::ElementsAre;

FrameRecord RecordOf(int64_t id) {
  FrameRecord record;
  record.id.value = id;
  record.map.value = 3;
  record.tracked_online = true;
  record.cam_from_world = SE3(Eigen::Quaterniond::Identity(), {1, 2, 3});
  return record;
}

class Recorder : public Observer {
 public:
  void OnFrame(const FrameEvent& event) override {
    frames.push_back(event.frame);
    metrics.push_back(event.metric);
    entered.release();
    if (block) released.wait();
    if (throws) throw std::runtime_error("no");
  }
  void OnMap(const MapEvent& event) override {
    maps.push_back(event);
    dropped_before_map.push_back(dropped);
  }
  void OnRestart() override {
    ++restarts;
    frames.clear();
  }
  void OnDropped(std::int64_t count) override { dropped += count; }

  std::vector<Frame> frames;
  std::vector<std::optional<MetricPose>> metrics;
  std::vector<MapEvent> maps;
  std::vector<std::int64_t> dropped_before_map;
  std::int64_t dropped = 0;
  int restarts = 0;
  bool block = false, throws = false;
  std::counting_semaphore<> entered{0};  ///< OnFrame.
  std::shared_future<void> released;
};

std::vector<std::int64_t> Ids(const Recorder& recorder) {
  std::vector<std::int64_t> ids;
  for (const Frame& frame : recorder.frames) ids.push_back(frame.id);
  return ids;
}

constexpr size_t kPlenty = 256;

TEST(EventQueue, TellsFramesInMetresOnceTheyAreKnown) {
  Recorder recorder;
  {
    EventQueue queue(&recorder, kPlenty);
    queue.OnFrame(RecordOf(1), {});
    queue.UseMetric(MapId{3}, 0, {Sim3(2, Eigen::Quaterniond::Identity(), {0, 0, 5}), 0.01, {}});
    queue.OnFrame(RecordOf(2), {});
    queue.UseMetric(MapId{3}, 0, {Sim3(), 0.02, GeoPoint{47, 8, 400}});
    queue.OnFrame(RecordOf(3), {});
    FrameRecord lost = RecordOf(4);
    lost.map = {};
    queue.OnFrame(lost, {});
    queue.OnRestart();
    queue.OnFrame(RecordOf(1), {});
  }
  ASSERT_EQ(recorder.metrics.size(), 5u);
  EXPECT_FALSE(recorder.metrics[0] || recorder.metrics[3] || recorder.metrics[4]);
  const MetricPose& metres = recorder.metrics[1].value();
  EXPECT_EQ(metres.gauge, GaugeKind::kMetric);
  EXPECT_DOUBLE_EQ(metres.metric_from_camera.translation.x, -2);
  EXPECT_DOUBLE_EQ(metres.metric_from_camera.translation.z, -1);
  EXPECT_DOUBLE_EQ(metres.scale_sigma, 0.01);
  const MetricPose& place = recorder.metrics[2].value();
  EXPECT_EQ(place.gauge, GaugeKind::kGeoreferenced);
  EXPECT_DOUBLE_EQ(place.metric_from_camera.translation.x, -1);
  EXPECT_DOUBLE_EQ(place.origin_altitude_m, 400);
}

TEST(EventQueue, TellsAllInOrderBeforeItEnds) {
  Recorder recorder;
  {
    EventQueue queue(&recorder, kPlenty);
    for (int64_t id : {0, 1, 2}) queue.OnFrame(RecordOf(id), {});
    queue.OnMap({::deepuav::MapChange::kMerged, MapId{1}, MapId{0}});
  }
  EXPECT_THAT(Ids(recorder), ElementsAre(0, 1, 2));
  EXPECT_EQ(recorder.frames[0].map, 3);
  EXPECT_EQ(recorder.frames[0].state, FrameState::kTracked);
  EXPECT_EQ(recorder.frames[0].world_from_camera.translation.y, -2);
  ASSERT_EQ(recorder.maps.size(), 1u);
  EXPECT_EQ(recorder.maps[0].change, MapChange::kMerged);
  EXPECT_EQ(recorder.maps[0].map, 1);
  EXPECT_EQ(recorder.maps[0].into, 0);
}

TEST(EventQueue, TellsThatARunBeginsAnewInItsPlace) {
  Recorder recorder;
  {
    EventQueue queue(&recorder, kPlenty);
    for (int64_t id : {0, 1, 2}) queue.OnFrame(RecordOf(id), {});
    queue.OnRestart();
    for (int64_t id : {0, 1}) queue.OnFrame(RecordOf(id), {});
  }
  EXPECT_EQ(recorder.restarts, 1);
  EXPECT_THAT(Ids(recorder), ElementsAre(0, 1));
}

TEST(EventQueue, DropsTheOldestOfASlowObserverAndCounts) {
  Recorder recorder;
  std::promise<void> release;
  recorder.block = true;
  recorder.released = release.get_future().share();
  {
    EventQueue queue(&recorder, 4);
    constexpr int kEvents = 20;
    for (int64_t id = 0; id < kEvents; ++id) queue.OnFrame(RecordOf(id), {});  // must not wait
    release.set_value();
  }
  EXPECT_EQ(static_cast<std::int64_t>(recorder.frames.size()) + recorder.dropped, 20);
  EXPECT_GE(recorder.dropped, 15);
  EXPECT_EQ(recorder.frames.back().id, 19);
}

TEST(EventQueue, ASlowObserverIsToldOfEveryChangeInItsPlace) {
  Recorder recorder;
  std::promise<void> release;
  recorder.block = true;
  recorder.released = release.get_future().share();
  {
    EventQueue queue(&recorder, 4);
    queue.OnFrame(RecordOf(0), {});
    recorder.entered.acquire();
    int64_t id = 1;
    for (; id < 10; ++id) queue.OnFrame(RecordOf(id), {});
    queue.OnMap({::deepuav::MapChange::kMerged, MapId{1}, MapId{0}});
    queue.OnRestart();
    for (; id < 20; ++id) queue.OnFrame(RecordOf(id), {});
    queue.OnMap({::deepuav::MapChange::kLoopClosed, MapId{0}, MapId{0}});
    for (; id < 22; ++id) queue.OnFrame(RecordOf(id), {});
    release.set_value();
  }
  EXPECT_EQ(recorder.restarts, 1);
  ASSERT_EQ(recorder.maps.size(), 2u);
  EXPECT_EQ(recorder.maps[0].change, MapChange::kMerged);
  EXPECT_EQ(recorder.maps[1].change, MapChange::kLoopClosed);
  EXPECT_THAT(Ids(recorder), ElementsAre(18, 19, 20, 21));
  EXPECT_THAT(recorder.dropped_before_map, ElementsAre(9, 9 + 8));
  EXPECT_EQ(recorder.dropped, 9 + 8);
}

TEST(EventQueue, ChangesThatWaitAreLimitedToo) {
  Recorder recorder;
  std::promise<void> release;
  recorder.block = true;
  recorder.released = release.get_future().share();
  constexpr int kMore = 100, kChanges = static_cast<int>(EventQueue::kMostChanges) + kMore;
  {
    EventQueue queue(&recorder, 4);
    queue.OnFrame(RecordOf(0), {});
    queue.OnRestart();
    for (int64_t map = 0; map < kChanges; ++map)
      queue.OnMap({::deepuav::MapChange::kStarted, MapId{map}, MapId{map}});
    release.set_value();
  }
  EXPECT_EQ(recorder.restarts, 1);
  EXPECT_EQ(recorder.dropped, kMore);
  ASSERT_EQ(recorder.maps.size(), EventQueue::kMostChanges);
  EXPECT_EQ(recorder.maps.front().map, kMore);
  EXPECT_EQ(recorder.maps.back().map, kChanges - 1);
}

TEST(EventQueue, AnObserverThatThrowsIsToldNothingMore) {
  Recorder recorder;
  recorder.throws = true;
  {
    EventQueue queue(&recorder, kPlenty);
    for (int64_t id : {0, 1}) queue.OnFrame(RecordOf(id), {});
  }
  EXPECT_THAT(Ids(recorder), ElementsAre(0));
}

}  // namespace
}  // namespace deepuav::api
