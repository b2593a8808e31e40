// What becomes of a keyframe behind the Tracker, in one thread and in several.

#include "deepuav/system/lanes/back_end.h"

#include <gtest/gtest.h>

#include <atomic>
#include <ctime>
#include <stdexcept>
#include <thread>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/lanes/mapping_lane.h"
#include "deepuav/system/lanes/shared_matcher.h"
#include "support/synthetic_places.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

class FailingMatcher : public Matcher {
 public:
  std::vector<Match> MatchFeatures(const Features& a, const Features& b) override {
    if (fails) throw std::runtime_error("the matcher broke");
    return matcher_.MatchFeatures(a, b);
  }
  std::string Description() const override { return "failing"; }

  bool fails = false;

 private:
  NearestNeighbourMatcher matcher_{{}};
};

/// A place that is known, and a flight in a map of its own that is just passing it.
class BackEndTest : public testing::Test {
 protected:
  explicit BackEndTest(bool place_is_older = true) {
    const auto add_place = [this] { place_ = made_.Add(made_.AddMap(), FlightAlongStrip(0, 8)); };
    if (place_is_older) add_place();
    flight_ = made_.Add(made_.AddMap(), FlightAlongStrip(1, 3, 0.5, 1), map_from_world_);
    if (!place_is_older) add_place();
    vocabulary_.emplace(VocabularyOf(made_.views));
    places_.emplace(&*vocabulary_, RecogniserOptions{});
    closer_.emplace(world_.camera(), LoopingOptions{}, LocatorOptions{}, &*places_,
                    PlaceMatchers{&matcher_}, nullptr);
    for (KeyframeId id : place_.keyframes) places_->Remember(made_.atlas.At(place_.map).At(id));
  }

  /// For a frame at `x`, as tracked against the flight's last keyframe.
  KeyframeRequest Request(double x) {
    const SE3 truth = LookDown({x, 0.5, 12}, 0);
    const SyntheticView view = world_.View(truth, {0.5, 0.3, 0, 20}, &made_.random);
    const KeyframeId last = flight_.keyframes.back();
    const SE3 step = truth * made_.truth[static_cast<size_t>(last.value)].Inverse();
    const double scale = map_from_world_.scale();
    KeyframeRequest request{flight_.map,
                            FrameOf(100 + static_cast<int64_t>(10 * x), view),
                            {last, SE3(step.rotation(), scale * step.translation()), 1},
                            {},
                            {}};
    for (size_t i = 0; i < view.landmark.size(); ++i) {
      if (view.landmark[i] < 0) continue;
      const LandmarkId id = flight_.landmark_of[static_cast<size_t>(view.landmark[i])];
      if (id.valid()) request.matches.push_back({static_cast<int>(i), id});
    }
    return request;
  }
  BackEnd MakeBackEnd() {
    return BackEnd(&made_.atlas, &mapper_, &*places_, &*closer_, nullptr, 2, nullptr);
  }

  const FeatureWorld world_ = StripOfGround(1, 1000);
  SyntheticVisits made_{world_, 2};
  const Sim3 map_from_world_{1.5, RotationExp({0.1, 0.2, 1}), {4, 5, 6}};
  Visit place_, flight_;
  FailingMatcher matcher_;
  Mapper mapper_{world_.camera(), {}, &made_.atlas, nullptr};
  std::optional<Vocabulary> vocabulary_;
  std::optional<PlaceMemory> places_;
  std::optional<LoopCloser> closer_;
};

class BackEndOnLaneTest : public BackEndTest, public testing::WithParamInterface<bool> {
 protected:
  std::unique_ptr<MappingLane> MakeLane(BackEnd* back_end) const {
    if (!GetParam()) return std::make_unique<SequentialLane>(back_end);
    back_end->AdjustBeside(false);
    return std::make_unique<ThreadedLane>(back_end);
  }
};

TEST_P(BackEndOnLaneTest, JoinsMapsWhileTheTrackerGoesOnUnderTheOldName) {
  BackEnd back_end = MakeBackEnd();
  const auto lane = MakeLane(&back_end);
  for (const double x : {3.5, 4.5, 5.5}) {
    lane->Submit(Request(x));
    EXPECT_EQ(lane->Collect()->map, flight_.map) << "made before the loop is closed";
  }
  lane->Settle();
  EXPECT_EQ(back_end.merged_maps(), 1);
  EXPECT_EQ(back_end.closed_loops(), 0);
  EXPECT_EQ(made_.atlas.Remaining(), std::vector<MapId>{place_.map});
  for (const double x : {6.5, 7.5, 8.5}) {  // With the second the adjustment enters.
    lane->Submit(Request(x));
    const LocalMapPtr local_map = lane->Collect();
    EXPECT_EQ(local_map->map, place_.map);
    const SE3& pose = local_map->keyframes[static_cast<size_t>(local_map->centre)].cam_from_world;
    EXPECT_LT((pose.InverseTranslation() - Eigen::Vector3d(x, 0.5, 12)).norm(), 0.2);
  }
  lane->Settle();
}

INSTANTIATE_TEST_SUITE_P(Lanes, BackEndOnLaneTest, testing::Bool());

/// Notes the headings that it is asked for.
class NotingDescriber : public TurnedDescriber {
 public:
  Descriptors DescribeTurned(const GreyImage& /*image*/, const Features& features,
                             int quarter_turns) override {
    asked.push_back(quarter_turns);
    return features.descriptors;
  }

  std::vector<int> asked;
};

TEST_F(BackEndTest, DescribesKeyframesUnderTheHeadingsThatMayTellOfALoop) {
  NotingDescriber describer;
  BackEnd back_end(&made_.atlas, &mapper_, &*places_, &*closer_, &describer, 2, nullptr);
  const auto take = [&](double x) {
    KeyframeRequest request = Request(x);
    const Camera& camera = world_.camera();
    request.frame.image = std::make_shared<const ImagePyramid>(
        GreyImage(camera.height, camera.width, uint8_t{128}), 3);
    describer.asked.clear();
    back_end.InsertKeyframe(request);
    back_end.CloseLoops();
    return describer.asked;
  };
  for (const double x : {3.5, 4.5, 5.5})
    EXPECT_EQ(take(x), (std::vector<int>{1, 2, 3})) << "of the other map no heading is known";
  ASSERT_EQ(back_end.merged_maps(), 1);
  for (int k = 0; k < 8; ++k) EXPECT_TRUE(take(6.5 + k).empty()) << "all of one heading: " << k;
}

/// The merger that it is told of.
class MergerRecorder : public RunObserver {
 public:
  void OnFrame(const FrameRecord& /*record*/, const Frame& /*frame*/) override {}
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& event) override {
    if (event.change == MapChange::kMerged) mergers.push_back(event);
  }

  std::vector<MapEvent> mergers;
};

void ExpectNear(const Sim3& found, const Sim3& expected) {
  const Sim3 between = found * expected.Inverse();
  EXPECT_NEAR(between.scale(), 1, 0.02);
  EXPECT_LT(Eigen::AngleAxisd(between.rotation()).angle(), 0.02);
  EXPECT_LT(between.translation().norm(), 0.5);
}

class OlderFlightTest : public BackEndTest {
 protected:
  OlderFlightTest() : BackEndTest(false) {}
};

/// `into_from_map`: nearly the one it is to tell.
void ExpectMerger(BackEnd back_end, const std::vector<KeyframeRequest>& requests, MapId map,
                  MapId into, const Sim3& into_from_map) {
  MergerRecorder recorder;
  back_end.Observe(&recorder);
  SequentialLane lane(&back_end);
  for (const KeyframeRequest& request : requests) lane.Submit(request);
  ASSERT_EQ(recorder.mergers.size(), 1);
  const MapEvent& merger = recorder.mergers[0];
  EXPECT_EQ(merger.map, map);
  EXPECT_EQ(merger.into, into);
  EXPECT_GT(merger.revision, 0);
  ExpectNear(merger.into_from_map, into_from_map);
}

TEST_F(BackEndTest, TellsThatTheYoungerMapBecamePartOfTheOlder) {
  ExpectMerger(MakeBackEnd(), {Request(3.5), Request(4.5), Request(5.5)}, flight_.map, place_.map,
               map_from_world_.Inverse());
}

TEST_F(OlderFlightTest, TellsItWhereTheCameraIsInTheOlderOne) {
  ExpectMerger(MakeBackEnd(), {Request(3.5), Request(4.5), Request(5.5)}, place_.map, flight_.map,
               map_from_world_);
}

TEST_F(BackEndTest, WhatClosingLoopsThrowsReachesTheCallerOfAThreadedLane) {
  matcher_.fails = true;
  BackEnd back_end = MakeBackEnd();
  ThreadedLane lane(&back_end);
  lane.Submit(Request(3.5));
  EXPECT_TRUE(lane.Collect()) << "the keyframe itself is in the map";
  EXPECT_THROW(lane.Settle(), std::runtime_error);
  EXPECT_THROW(lane.Settle(), std::runtime_error) << "as often as it is asked";
  lane.Submit(Request(4.5));
  EXPECT_THROW(lane.Collect(), std::runtime_error) << "and with the next keyframe";
}

TEST_F(BackEndTest, WhatClosingLoopsThrowsReachesTheCallerOfASequentialLane) {
  matcher_.fails = true;
  BackEnd back_end = MakeBackEnd();
  SequentialLane lane(&back_end);
  EXPECT_THROW(lane.Submit(Request(3.5)), std::runtime_error);
}

TEST_F(BackEndTest, ALaneCanBeLeftWithWorkUnderWay) {
  const int before = made_.atlas.At(flight_.map).KeyframeCount();
  {
    BackEnd back_end = MakeBackEnd();
    ThreadedLane lane(&back_end);
    EXPECT_FALSE(lane.Ready());
    lane.Submit(Request(3.5));
  }
  EXPECT_EQ(made_.atlas.At(flight_.map).KeyframeCount(), before + 1) << "which is still done";
}

/// The CPU time that each stage took in its thread.
class CpuTimes : public StageListener {
 public:
  void Begin(const char*) override { began_s_ = Now(); }
  void End(const char*) override { last_s = Now() - began_s_; }
  double last_s = 0;

 private:
  static double Now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double began_s_ = 0;
};

class PendingAdjustmentTest : public BackEndTest {
 protected:
  GlobalAdjustment Prepare() {
    Map& map = made_.atlas.At(place_.map);
    std::vector<LandmarkId> landmarks;
    map.landmarks().ForEach([&](const Landmark& l) { landmarks.push_back(l.id); });
    for (LandmarkId id : landmarks)
      map.SetPosition(id, map.At(id).position_world + 0.5 * RandomDirection(&made_.random));
    return GlobalAdjustment(map, world_.world().pinhole,
                            {.max_iterations = 60, .min_relative_decrease = 1e-12});
  }
  CpuTimes times_;
};

TEST_F(PendingAdjustmentTest, GivesWhatIsComputedHereOrBeside) {
  const GlobalAdjustment prepared = Prepare();
  Map& map = made_.atlas.At(place_.map);
  const KeyframeId moved = place_.keyframes[5];
  std::vector<SE3> adjusted;
  for (const bool on_own_thread : {false, true}) {
    PendingAdjustment pending(prepared, on_own_thread, &times_);
    EXPECT_TRUE(on_own_thread || pending.Ready());
    const GlobalAdjustment& adjustment = pending.Get();
    EXPECT_TRUE(pending.Ready());
    EXPECT_EQ(adjustment.map(), place_.map);
    map.SetPose(moved, LookDown({9, 3, 11}, 0.5));
    adjustment.Apply(&map);
    adjusted.push_back(map.At(moved).cam_from_world);
  }
  EXPECT_LT((adjusted[0].InverseTranslation() - Eigen::Vector3d(10, 0, 12)).norm(), 0.2);
  EXPECT_LT((adjusted[0] * adjusted[1].Inverse()).Log().norm(), 1e-12);
}

TEST_F(PendingAdjustmentTest, StopsWhenItIsGivenUp) {
  const GlobalAdjustment prepared = Prepare();
  PendingAdjustment(prepared, true, &times_).Get();
  const double whole_s = times_.last_s;
  { const PendingAdjustment given_up(prepared, true, &times_); }
  EXPECT_LT(times_.last_s, whole_s / 3);
}

TEST_F(PendingAdjustmentTest, EndsWithWhatItHasWhenItIsStopped) {
  const GlobalAdjustment prepared = Prepare();
  PendingAdjustment(prepared, true, &times_).Get();
  const double whole_s = times_.last_s;
  for (const bool on_own_thread : {false, true}) {
    PendingAdjustment pending(prepared, on_own_thread, &times_, [] { return true; });
    EXPECT_EQ(pending.Get().map(), place_.map);
    EXPECT_LT(times_.last_s, whole_s / 3);
  }
}

TEST_F(BackEndTest, AStoppedRunDoesNotWaitForAGlobalAdjustment) {
  BackEnd back_end = MakeBackEnd();
  int asked = 0;
  back_end.StopWhen([&asked] {
    ++asked;
    return true;
  });
  SequentialLane lane(&back_end);
  for (const double x : {3.5, 4.5, 5.5}) lane.Submit(Request(x));
  EXPECT_EQ(back_end.merged_maps(), 1);
  EXPECT_GT(asked, 0);
}

TEST(SharedMatcher, LetsOneThreadInAtATime) {
  class Watched : public Matcher {
   public:
    std::vector<Match> MatchFeatures(const Features&, const Features&) override {
      if (inside_.exchange(true)) collided = true;
      std::this_thread::yield();
      inside_ = false;
      ++calls;
      return {{1, 2, 0.5f}};
    }
    std::string Description() const override { return "watched"; }
    std::atomic<bool> collided{false};
    std::atomic<int> calls{0};

   private:
    std::atomic<bool> inside_{false};
  };
  Watched watched;
  SharedMatcher shared(&watched);
  const Features nothing{{}, Descriptors(2)};
  const auto work = [&] {
    for (int i = 0; i < 2000; ++i) shared.MatchFeatures(nothing, nothing);
  };
  std::thread other(work);
  work();
  other.join();
  EXPECT_EQ(watched.calls, 4000);
  EXPECT_FALSE(watched.collided);
  EXPECT_EQ(shared.MatchFeatures(nothing, nothing)[0].b, 2);
  EXPECT_EQ(shared.Description(), "watched");
}

}  // namespace
}  // namespace deepuav
