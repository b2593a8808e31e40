#include "deepuav/system/sensors/metric_watch.h"

#include <gtest/gtest.h>

#include <mutex>
#include <utility>
#include <vector>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

const SE3 kCamFromImu(RotationExp({1.9, -0.4, 0.3}), {0.1, -0.2, 0.05});
const Sim3 kWorldFromLevel(0.05, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
constexpr double kEnd_s = 25, kRate_hz = 10;

ImuStream Stream() {
  ImuStream imu;
  imu.cam_from_imu = kCamFromImu;
  imu.noise = {1.7e-4, 2e-5, 2e-3, 3e-3};
  imu.samples = InertialFlight().Samples(0, kEnd_s + 1, 200);
  return imu;
}

struct Told {
  MapId map;
  int64_t revision;
  MetricWorld world;
};

/// When samples come: all before the first pose, or each pose after those up to so much later.
struct Delivery {
  std::optional<double> ahead_s;
};

/// What is told of a flight whose map becomes another, or moves, where `change` says so.
std::vector<Told> Watch(const std::function<void(double t, FrameRecord*)>& change,
                        std::optional<Gauge> gauge = std::nullopt, Delivery delivery = {}) {
  std::vector<Told> told;
  std::mutex mutex;
  ImuStream imu = Stream();
  std::vector<ImuSample> to_come;
  if (delivery.ahead_s) to_come = std::exchange(imu.samples, {});
  auto next = to_come.begin();
  {
    MetricWatch watch(imu, {}, [&](MapId map, int64_t revision, const MetricWorld& world) {
      const std::scoped_lock lock(mutex);
      told.push_back({map, revision, world});
    });
    if (gauge) watch.OnGauge(MapId{0}, 0, *gauge);
    const Trajectory path =
        InertialFlight().CameraPath(1, kEnd_s, kRate_hz, kCamFromImu, kWorldFromLevel);
    for (const TimedPose& pose : path) {
      for (; next != to_come.end() && SecondsBetween(pose.time, next->time) <= *delivery.ahead_s;
           ++next)
        watch.AddSample(*next);
      FrameRecord record;
      record.time = pose.time;
      record.map = MapId{0};
      record.cam_from_world = pose.world_from_cam.Inverse();
      change(SecondsBetween(AtSeconds(0), pose.time), &record);
      watch.OnFrame(record, {});
    }
  }
  return told;
}

TEST(MetricWatch, TellsMetresOnTheWay) {
  const auto told = Watch([](double, FrameRecord* record) { record->map_revision = 3; });
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.front().map, MapId{0});
  EXPECT_EQ(told.front().revision, 3);
  EXPECT_NEAR(told.back().world.metric_from_world.scale() * kWorldFromLevel.scale(), 1, 0.02);
}

TEST(MetricWatch, SamplesThatComeInPiecesTellTheSame) {
  const auto stay = [](double, FrameRecord*) {};
  const auto whole = Watch(stay), pieces = Watch(stay, {}, {1.1});
  ASSERT_FALSE(whole.empty());
  ASSERT_EQ(pieces.size(), whole.size());
  for (size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(pieces[i].world.metric_from_world.scale(), whole[i].world.metric_from_world.scale());
    EXPECT_EQ(pieces[i].world.scale_sigma, whole[i].world.scale_sigma);
  }
}

TEST(MetricWatch, SamplesThatComeAfterTheirPosesAreEnough) {
  const auto told = Watch([](double, FrameRecord*) {}, {}, {-0.03});
  ASSERT_FALSE(told.empty());
  EXPECT_NEAR(told.back().world.metric_from_world.scale() * kWorldFromLevel.scale(), 1, 0.02);
}

TEST(MetricWatch, StartsAnewInAnotherMap) {
  const auto told = Watch([](double t, FrameRecord* record) {
    if (t < 13) return;
    record->map = MapId{1};
    record->cam_from_world =
        Sim3(2, Eigen::Quaterniond::Identity(), {0, 0, 0}).MovePose(record->cam_from_world);
  });
  ASSERT_GE(told.size(), 2u);
  EXPECT_EQ(told.front().map, MapId{0});
  EXPECT_EQ(told.back().map, MapId{1});
  EXPECT_NEAR(told.back().world.metric_from_world.scale() * 2 * kWorldFromLevel.scale(), 1, 0.03);
}

TEST(MetricWatch, SaysNothingOfLostFramesOrMapsWithMetres) {
  EXPECT_TRUE(Watch([](double, FrameRecord* record) { record->map = {}; }).empty());
  EXPECT_TRUE(Watch([](double, FrameRecord*) {}, Gauge{GaugeKind::kMetric, {}, 0.01}).empty());
}

}  // namespace
}  // namespace deepuav
