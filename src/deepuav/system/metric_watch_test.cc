#include "deepuav/system/metric_watch.h"

#include <gtest/gtest.h>

#include <mutex>
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

/// What is told of a flight whose map becomes another, or moves, where `change` says so.
std::vector<Told> Watch(const std::function<void(double t, FrameRecord*)>& change,
                        std::optional<Gauge> gauge = std::nullopt) {
  std::vector<Told> told;
  std::mutex mutex;
  {
    MetricWatch watch(Stream(), {}, [&](MapId map, int64_t revision, const MetricWorld& world) {
      const std::scoped_lock lock(mutex);
      told.push_back({map, revision, world});
    });
    if (gauge) watch.OnGauge(MapId{0}, 0, *gauge);
    const Trajectory path =
        InertialFlight().CameraPath(1, kEnd_s, kRate_hz, kCamFromImu, kWorldFromLevel);
    for (const TimedPose& pose : path) {
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
