#include "deepuav/autopilot/autopilot_observer.h"

#include <gtest/gtest.h>

#include "deepuav/autopilot/constant_velocity.h"
#include "deepuav/autopilot/mount.h"
#include "deepuav/matching/nearest_neighbour.h"
#include "deepuav/system/slam.h"
#include "deepuav/system/watching/observer_list.h"
#include "support/synthetic_court.h"

namespace deepuav {
namespace {

constexpr FeatureNoise kNoise{0.5, 0.2, 0, 20};
constexpr int kFrames = kLap + 80;  // Around the court and on past its beginning.

OdometryEstimator Estimator() {
  return {SE3(ParseMount("forward"), Eigen::Vector3d::Zero()),
          {},
          std::make_unique<ConstantVelocity>()};
}

/// What every frame is in, and how well its pose is known.
class Recorder : public RunObserver {
 public:
  void OnFrame(const FrameRecord& record, const Frame& /*frame*/) override {
    if (record.located()) frames.push_back(record);
  }
  void OnKeyframe(KeyframeEvent /*event*/) override {}
  void OnMap(const MapEvent& event) override { changes += event.change != MapChange::kStarted; }
  void OnGauge(MapId map, int64_t revision, const Gauge& gauge) override {
    gauges.push_back({map, revision, gauge});
  }

  struct Told {
    MapId map;
    int64_t revision = 0;
    Gauge gauge;
  };
  std::vector<FrameRecord> frames;
  std::vector<Told> gauges;
  int changes = 0;  ///< Of maps as a whole.
};

class AutopilotObserverTest : public testing::Test {
 protected:
  AutopilotObserverTest()
      : flight_(MakeFlight(Court(2), Walk(0, kFrames), kNoise, 3)),
        vocabulary_(VocabularyOf(flight_)) {
    // A wrong calibration drifts, so that there is a loop to close.
    flight_.camera.pinhole.fx *= 1.04;
    flight_.camera.pinhole.fy *= 1.04;
  }

  Atlas Fly(RunObserver* observer, std::optional<Atlas> loaded = std::nullopt) {
    PreparedFeatures extractor(flight_.features);
    NearestNeighbourMatcher matcher({});
    NumberedImages images(flight_.size(), flight_.frame_interval_s);
    Slam slam(flight_.camera, {}, Perception{&extractor, &matcher, &vocabulary_, nullptr});
    if (loaded) slam.Load(std::move(*loaded));
    slam.Observe(observer);
    slam.Run(&images, Schedule::kSequential);
    return slam.TakeAtlas();
  }

  SyntheticFlight flight_;
  const Vocabulary vocabulary_;
};

TEST_F(AutopilotObserverTest, EveryCorrectionReachesTheFramesOnce) {
  Recorder recorder;
  Fly(&recorder);
  ASSERT_GT(recorder.changes, 1) << "a loop, and an adjustment after it";
  OdometryEstimator estimator = Estimator();
  int corrections = 0;
  for (size_t i = 0; i < recorder.frames.size(); ++i) {
    const FrameRecord& frame = recorder.frames[i];
    if (i > 0) {
      EXPECT_GE(frame.map_revision, recorder.frames[i - 1].map_revision);
      corrections += static_cast<int>(frame.map_revision - recorder.frames[i - 1].map_revision);
    }
    const Eigen::LLT<Matrix6d> factor(frame.pose_information);
    ASSERT_EQ(factor.info(), Eigen::Success);
    const Matrix6d covariance = factor.solve(Matrix6d::Identity());
    // In the unit of the map, the median depth of its first view.
    EXPECT_GT(std::sqrt(covariance(0, 0)), 1e-6);
    EXPECT_LT(std::sqrt(covariance.diagonal().maxCoeff()), 0.05);
    estimator.Add({frame.time.nanoseconds, frame.map, frame.map_revision, frame.cam_from_world,
                   frame.pose_information, frame.landmark_count},
                  MetricFromMap{});
  }
  EXPECT_EQ(corrections, recorder.changes);
  const auto last = estimator.At(recorder.frames.back().time.nanoseconds);
  ASSERT_TRUE(last.odometry);
  EXPECT_EQ(last.odometry->reset_counter, corrections);
}

TEST_F(AutopilotObserverTest, SpeaksInMapsThatHaveMetresOnly) {
  Recorder recorder;
  AutopilotObserver autopilot(Estimator());
  ObserverList both;
  both.Add(&recorder);
  both.Add(&autopilot);
  Atlas atlas = Fly(&both);
  EXPECT_TRUE(recorder.gauges.empty()) << "no map was there";
  EXPECT_EQ(autopilot.At(SteadyNow()).why, OdometryEstimator::Silence::kNoScale);
  atlas.ChangeGauge(MapId{0}, Sim3(), {GaugeKind::kMetric, {}, 0.01});
  AutopilotObserver metric(Estimator());
  ObserverList again;
  again.Add(&recorder);
  again.Add(&metric);
  Fly(&again, std::move(atlas));
  ASSERT_FALSE(recorder.gauges.empty());
  EXPECT_EQ(recorder.gauges.front().gauge.kind, GaugeKind::kMetric);
  EXPECT_NE(metric.At(SteadyNow()).why, OdometryEstimator::Silence::kNoScale);
}

TEST(AutopilotObserver, TheMetricIsThatOfTheFramesRevision) {
  AutopilotObserver autopilot(Estimator());
  MetricFromMap georeferenced;
  georeferenced.origin = GeoPoint{47, 8, 400};
  autopilot.UseMetric(MapId{3}, 2, MetricFromMap{});
  autopilot.UseMetric(MapId{3}, 4, georeferenced);
  const auto origin_in = [&](int64_t revision) {
    FrameRecord record;
    record.map = MapId{3};
    record.map_revision = revision;
    record.time = Timestamp{revision};
    autopilot.OnFrame(record, Frame{});
    return autopilot.At(SteadyNow());
  };
  EXPECT_EQ(origin_in(1).why, OdometryEstimator::Silence::kNoScale);
  EXPECT_NE(origin_in(3).why, OdometryEstimator::Silence::kNoScale);
  EXPECT_FALSE(origin_in(3).origin);
  EXPECT_TRUE(origin_in(4).origin);
  EXPECT_TRUE(origin_in(9).origin);
}

TEST(AutopilotObserver, MetresOutlastAMerger) {
  const Sim3 old_from_young(0.5, RotationExp({0.1, 0.2, 0.3}), {1, 2, 3});
  const SE3 cam_from_young(RotationExp({0.3, -0.1, 0.2}), {0.4, 0.5, 0.6});
  const MapId old{0}, young{1};
  AutopilotObserver autopilot(Estimator());
  MetricFromMap metric;
  metric.metric_from_map = Sim3(4, RotationExp({1, 0, 0}), {0, 0, 7});
  metric.scale_sigma = 0.01;
  autopilot.UseMetric(young, 5, metric);
  const auto place_in = [&](MapId map, int64_t revision, const SE3& cam_from_map) {
    constexpr int64_t kInterval = 50'000'000;
    for (int i = 0; i < 2; ++i) {
      FrameRecord record;
      record.map = map;
      record.map_revision = revision;
      record.cam_from_world = cam_from_map;
      record.time = Timestamp{SteadyNow() + kInterval * i};
      autopilot.OnFrame(record, Frame{});
    }
    return autopilot.At(SteadyNow());
  };
  EXPECT_EQ(place_in(old, 8, {}).why, OdometryEstimator::Silence::kNoScale);
  autopilot.OnMap({MapChange::kMerged, young, old, old_from_young, 9});
  autopilot.OnGauge(old, 9, {});
  EXPECT_EQ(place_in(old, 8, {}).why, OdometryEstimator::Silence::kNoScale) << "a frame before it";
  const auto before = place_in(young, 5, cam_from_young);
  const auto after = place_in(old, 9, old_from_young.MovePose(cam_from_young));
  ASSERT_TRUE(before.odometry && after.odometry);
  EXPECT_LT((before.odometry->local_from_body.translation() -
             after.odometry->local_from_body.translation())
                .norm(),
            1e-6);
}

/// What is known of the map where the next frame lies.
OdometryEstimator::Answer AnswerIn(MapId map, int64_t revision, AutopilotObserver* autopilot) {
  FrameRecord record;
  record.map = map;
  record.map_revision = revision;
  record.time = Timestamp{SteadyNow()};
  autopilot->OnFrame(record, Frame{});
  return autopilot->At(SteadyNow());
}

TEST(AutopilotObserver, APlaceIsNotGivenUpForMetres) {
  const MapId old{0}, young{1};
  AutopilotObserver autopilot(Estimator());
  MetricFromMap place;
  place.origin = GeoPoint{47, 8, 400};
  autopilot.UseMetric(old, 1, MetricFromMap{});
  autopilot.UseMetric(young, 1, place);
  autopilot.UseMetric(young, 2, MetricFromMap{});
  EXPECT_TRUE(AnswerIn(young, 2, &autopilot).origin);
  // Into a map that has metres alone.
  autopilot.OnMap({MapChange::kMerged, young, old, Sim3(), 3});
  autopilot.OnGauge(old, 3, {GaugeKind::kMetric, {}, 0.01});
  EXPECT_TRUE(AnswerIn(old, 3, &autopilot).origin);
}

TEST(AutopilotObserver, FoundAnewMetresKeepHeadingAndOrigin) {
  AutopilotObserver autopilot(Estimator());
  const auto told_with = [&](const MetricFromMap& metric, int64_t revision) {
    autopilot.UseMetric(MapId{0}, revision, metric);
    FrameRecord record;
    record.map = MapId{0};
    record.map_revision = revision;
    record.cam_from_world = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 2, 3));
    for (int i = 0; i < 2; ++i) autopilot.OnFrame(record, Frame{});
    return autopilot.At(SteadyNow()).odometry->local_from_body;
  };
  MetricFromMap metric;
  metric.metric_from_map = Sim3(2, RotationExp({0, 0, 0.4}), {5, 6, 7});
  const SE3 before = told_with(metric, 1);
  metric.metric_from_map = Sim3(2.02, RotationExp({0, 0, -1.2}), {0, 0, 0});
  const SE3 after = told_with(metric, 2);
  EXPECT_LT((after.translation() - 1.01 * before.translation()).norm(), 1e-6);
  EXPECT_LT((before.Inverse() * after).Angle(), 1e-9);
  metric.origin = GeoPoint{47, 8, 400};
  EXPECT_GT((after.Inverse() * told_with(metric, 3)).Angle(), 0.1) << "a place on Earth is one";
}

TEST(AutopilotObserver, BringsSamplesAmongTheImages) {
  constexpr int64_t kSecond = 1'000'000'000, kImage = 5 * kSecond;
  constexpr int64_t kRounding = 10;  // Times pass through seconds in floating point.
  AutopilotObserver observer(Estimator());
  EXPECT_FALSE(observer.AmongImages({{SteadyNow()}, {}, {}})) << "no image came";
  const int64_t before = SteadyNow();
  observer.Arrived({kImage}, Stopwatch());
  const int64_t after = SteadyNow();
  const auto sample = observer.AmongImages({{after}, {1, 2, 3}, {4, 5, 6}});
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->specific_force, Eigen::Vector3d(4, 5, 6));
  EXPECT_GE(sample->time.nanoseconds, kImage);
  EXPECT_LE(sample->time.nanoseconds, kImage + after - before + kRounding);
  EXPECT_FALSE(observer.AmongImages({{after}, {}, {}})) << "the same again";
  EXPECT_FALSE(observer.AmongImages({{before - kSecond}, {}, {}}));
  EXPECT_TRUE(observer.AmongImages({{after + 5'000'000}, {}, {}}));
  // The images' clock jumps ahead.
  observer.Arrived({1000 * kSecond}, Stopwatch());
  const auto later = observer.AmongImages({{SteadyNow()}, {}, {}});
  ASSERT_TRUE(later);
  EXPECT_GE(later->time.nanoseconds, 1000 * kSecond);
}

TEST(AutopilotObserver, BringsFixesAmongTheImages) {
  constexpr int64_t kSecond = 1'000'000'000, kImage = 5 * kSecond;
  AutopilotObserver observer(Estimator());
  GnssFix fix;
  fix.time = {SteadyNow()};
  EXPECT_FALSE(observer.FixAmongImages(fix)) << "no image came";
  observer.Arrived({kImage}, Stopwatch());
  fix.time = {SteadyNow()};
  fix.latitude_deg = 47;
  const auto among_images = observer.FixAmongImages(fix);
  ASSERT_TRUE(among_images);
  EXPECT_NEAR(1e-9 * static_cast<double>(among_images->time.nanoseconds - kImage), 0, 0.5);
  EXPECT_EQ(among_images->latitude_deg, 47);
  EXPECT_FALSE(observer.FixAmongImages(fix)) << "the same again";
}

}  // namespace
}  // namespace deepuav
