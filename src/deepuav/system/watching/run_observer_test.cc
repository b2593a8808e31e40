#include "deepuav/system/watching/run_observer.h"

#include <gmock/gmock.h>

#include <mutex>

#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"
#include "support/synthetic_court.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.2, 0, 20};
constexpr int kFrames = kLap + 30;  // around the court and on past its beginning

class Recorder : public RunObserver {
 public:
  void OnFrame(const FrameRecord& record, const Frame& frame) override {
    EXPECT_EQ(frame.id, record.id);
    const std::scoped_lock lock(mutex_);
    frames.push_back(record);
  }
  void OnKeyframe(KeyframeEvent event) override {
    const std::scoped_lock lock(mutex_);
    keyframes.push_back(std::move(event));
  }
  void OnMap(const MapEvent& event) override {
    const std::scoped_lock lock(mutex_);
    maps.push_back(event);
  }
  int Count(MapChange change) const {
    int count = 0;
    for (const MapEvent& event : maps) count += event.change == change;
    return count;
  }

  std::vector<FrameRecord> frames;
  std::vector<KeyframeEvent> keyframes;
  std::vector<MapEvent> maps;

 private:
  std::mutex mutex_;
};

struct Outcome {
  SlamResult result;
  Atlas atlas;
};

class RunObserverTest : public testing::Test {
 protected:
  RunObserverTest()
      : flight_(Drifting(MakeFlight(world_, Walk(0, kFrames), kNoise, 3))),
        vocabulary_(VocabularyOf(flight_)) {}

  /// A wrong calibration drifts, so that there is a loop to close.
  static SyntheticFlight Drifting(SyntheticFlight flight) {
    flight.camera.pinhole.fx *= 1.04;
    flight.camera.pinhole.fy *= 1.04;
    return flight;
  }

  /// As Fly; what was saved meanwhile goes into `saved`.
  Outcome FlySaving(Schedule schedule, std::vector<Outcome>* saved) {
    PreparedFeatures extractor(flight_.features);
    NearestNeighbourMatcher matcher({});
    NumberedImages images(flight_.size(), flight_.frame_interval_s);
    Slam slam(flight_.camera, {}, Perception{&extractor, &matcher, &vocabulary_, nullptr});
    int asked = 0;
    slam.SaveWhenDue([&asked] { return ++asked % 50 == 0; },
                     [saved](SlamResult result, Atlas atlas) {
                       saved->push_back({std::move(result), std::move(atlas)});
                     });
    Outcome outcome{slam.Run(&images, schedule), {}};
    outcome.atlas = slam.TakeAtlas();
    return outcome;
  }

  Outcome Fly(Schedule schedule, RunObserver* observer) {
    PreparedFeatures extractor(flight_.features);
    NearestNeighbourMatcher matcher({});
    NumberedImages images(flight_.size(), flight_.frame_interval_s);
    Slam slam(flight_.camera, {}, Perception{&extractor, &matcher, &vocabulary_, nullptr});
    slam.Observe(observer);
    slam.UseSensorsAtEnd([this] {
      ++asked_for_sensors_;
      return SensorStreams{};
    });
    Outcome outcome{slam.Run(&images, schedule), {}};
    outcome.atlas = slam.TakeAtlas();
    return outcome;
  }

  const FeatureWorld world_ = Court(2);
  const SyntheticFlight flight_;
  const Vocabulary vocabulary_;
  int asked_for_sensors_ = 0;
};

/// Frame and keyframe are told of at one moment, in one world.
void ExpectAgreement(const Recorder& recorder) {
  const KeyframeEvent& keyframe = recorder.keyframes.front();
  for (const FrameRecord& frame : recorder.frames) {
    if (frame.id != keyframe.frame || !frame.located()) continue;
    const SE3 apart = frame.cam_from_world * keyframe.cam_from_world.Inverse();
    EXPECT_LT(apart.translation().norm(), 0.05);
    EXPECT_LT(apart.Angle(), 0.01);
  }
}

TEST_F(RunObserverTest, IsToldOfAllAndChangesNothing) {
  const Outcome unseen = Fly(Schedule::kSequential, nullptr);
  EXPECT_EQ(asked_for_sensors_, 1);
  EXPECT_GT(unseen.result.closed_loops, 0);
  for (const Schedule schedule : {Schedule::kSequential, Schedule::kThreaded}) {
    Recorder recorder;
    const Outcome seen = Fly(schedule, &recorder);
    ASSERT_EQ(recorder.frames.size(), seen.result.frames.size());
    for (size_t i = 0; i < seen.result.frames.size(); ++i) {
      const FrameRecord &told = recorder.frames[i], &frame = seen.result.frames[i];
      EXPECT_EQ(told.id, frame.id);
      EXPECT_EQ(told.located(), frame.tracked_online);
      EXPECT_TRUE(frame.cam_from_world.Matrix() == unseen.result.frames[i].cam_from_world.Matrix())
          << i;
    }
    EXPECT_EQ(recorder.Count(MapChange::kStarted), 1);
    EXPECT_EQ(recorder.Count(MapChange::kLoopClosed), seen.result.closed_loops);
    EXPECT_GE(static_cast<int>(recorder.keyframes.size()), seen.atlas.At(MapId{0}).KeyframeCount());
    EXPECT_GT(recorder.keyframes.front().new_landmarks_world.size() +
                  recorder.keyframes[1].new_landmarks_world.size(),
              50u);
    ExpectAgreement(recorder);
  }
}

TEST_F(RunObserverTest, SavingMeanwhileGivesWhatThereIsAndChangesNothing) {
  const Outcome unsaved = Fly(Schedule::kSequential, nullptr);
  for (const Schedule schedule : {Schedule::kSequential, Schedule::kThreaded}) {
    std::vector<Outcome> saved;
    const Outcome outcome = FlySaving(schedule, &saved);
    ASSERT_EQ(outcome.result.frames.size(), unsaved.result.frames.size());
    for (size_t i = 0; i < outcome.result.frames.size(); ++i) {
      EXPECT_TRUE(outcome.result.frames[i].cam_from_world.Matrix() ==
                  unsaved.result.frames[i].cam_from_world.Matrix())
          << i;
    }
    ASSERT_EQ(saved.size(), outcome.result.frames.size() / 50);
    for (size_t i = 0; i < saved.size(); ++i) {
      const Outcome& meanwhile = saved[i];
      ASSERT_EQ(meanwhile.result.frames.size(), 50 * (i + 1));
      const Map& map = meanwhile.atlas.At(MapId{0});
      EXPECT_GT(map.KeyframeCount(), 1);
      for (const FrameRecord& record : meanwhile.result.frames) {
        EXPECT_TRUE(record.seen.empty());
        if (!record.located()) continue;
        EXPECT_TRUE(record.cam_from_world.Matrix() == map.PoseOf(record.pose).Matrix());
      }
    }
    EXPECT_LT(saved.front().atlas.At(MapId{0}).KeyframeCount(),
              outcome.atlas.At(MapId{0}).KeyframeCount());
  }
}

}  // namespace
}  // namespace deepuav
