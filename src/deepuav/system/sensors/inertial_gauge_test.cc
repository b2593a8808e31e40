#include "deepuav/system/sensors/inertial_gauge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/inertial_flight.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

const SE3 kCamFromImu(RotationExp({0.1, -0.2, 0.3}), {0.05, 0.02, -0.1});
constexpr int kFrames = 150;
constexpr double kFirst_s = 1, kRate_hz = 10;

/// A camera that swings above the ground as a sensor's exact motion has it.
struct Swing : InertialFlight {
  Eigen::Vector3d Position(double t) const override {
    return {12 + 6 * std::sin(0.5 * t), 3 * std::sin(0.8 * t + 1), 12 + std::sin(1.3 * t)};
  }
  Eigen::Vector3d Velocity(double t) const override {
    return {3 * std::cos(0.5 * t), 2.4 * std::cos(0.8 * t + 1), 1.3 * std::cos(1.3 * t)};
  }
  Eigen::Vector3d Acceleration(double t) const override {
    return {-1.5 * std::sin(0.5 * t), -1.92 * std::sin(0.8 * t + 1), -1.69 * std::sin(1.3 * t)};
  }
  Eigen::Vector3d Turn(double t) const override {
    return {0.1 * std::sin(t), 0.1 * std::sin(0.7 * t), 0.5 * std::sin(0.4 * t)};
  }
};

/// A map that lies askew in another scale, and records of its one keyframe and all other frames.
class InertialGaugeTest : public testing::Test {
 protected:
  InertialGaugeTest() : world_(StripOfGround(1, 1200)), made_(world_, 2) {
    const Trajectory path = Swing().CameraPath(kFirst_s, kFirst_s + (kFrames - 1) / kRate_hz,
                                               kRate_hz, kCamFromImu, kMapFromLevel);
    made_.AddMap();
    const Visit visit = made_.Add(MapId{0}, {LookDown({0, 0, 12}, 0), LookDown({3, 0, 12}, 0)},
                                  kMapFromLevel, {0.3, 0.3, 0, 0});
    const Keyframe& anchor = map().At(visit.keyframes[0]);
    keyframe_ = anchor.id;
    for (size_t i = 0; i < path.size(); ++i) {
      FrameRecord& record = records_.emplace_back();
      record.id = FrameId{1000 + static_cast<int64_t>(i)};
      record.time = path[i].time;
      record.map = MapId{0};
      record.pose = {keyframe_, path[i].world_from_cam.Inverse() * anchor.cam_from_world.Inverse(),
                     anchor.scale};
    }
    imu_.cam_from_imu = kCamFromImu;
    imu_.noise = {1e-4, 1e-5, 2e-3, 1e-3};
    imu_.samples = Swing().Samples(0, kFirst_s + kFrames / kRate_hz + 1, 200);
  }

  Map& map() { return made_.atlas.At(MapId{0}); }

  std::map<MapId, InertialAttempt> ApplyToAll() {
    Camera camera;
    camera.pinhole = world_.world().pinhole;
    camera.width = 752;
    camera.height = 480;
    Mapper mapper(camera, {}, &made_.atlas, nullptr);
    InertialGauge gauge(imu_, {}, nullptr, &mapper, &made_.atlas);
    return gauge.ApplyToAll({MapId{0}}, records_, nullptr);
  }

  const Sim3 kMapFromLevel{0.1, RotationExp({0.4, 0.2, -1}), {2, 1, -3}};
  const FeatureWorld world_;
  SyntheticVisits made_;
  KeyframeId keyframe_;
  std::vector<FrameRecord> records_;
  ImuStream imu_;
};

TEST_F(InertialGaugeTest, AMapComesToMetresAndLevel) {
  const auto attempts = ApplyToAll();
  const InertialAttempt& attempt = attempts.at(MapId{0});
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(attempt.found->level_from_world.scale(), 10, 0.02);
  const Gauge gauge = made_.atlas.GaugeOf(MapId{0});
  EXPECT_EQ(gauge.kind, GaugeKind::kMetric);
  EXPECT_EQ(gauge.scale_sigma, attempt.found->scale_sigma);
  // The frames move with their map: so far they truly flew, and so much of it upwards.
  const Trajectory path = PathIn(made_.atlas, MapId{0}, records_);
  const auto position = [](double t) {
    return Swing().WorldFromImu(t) * kCamFromImu.InverseTranslation();
  };
  const Eigen::Vector3d flown =
      path[40].world_from_cam.translation() - path[0].world_from_cam.translation();
  const Eigen::Vector3d truth = position(kFirst_s + 40 / kRate_hz) - position(kFirst_s);
  EXPECT_NEAR(flown.norm(), truth.norm(), 0.02);
  EXPECT_NEAR(flown.z(), truth.z(), 0.02);
}

TEST_F(InertialGaugeTest, LeavesAMapThatHasItsGauge) {
  made_.atlas.ChangeGauge(MapId{0}, Sim3(), {GaugeKind::kGeoreferenced, {47, 8, 500}, 0.01});
  EXPECT_TRUE(ApplyToAll().empty());
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kGeoreferenced);
}

TEST_F(InertialGaugeTest, LeavesAMapWhoseSamplesDoNotFit) {
  for (ImuSample& sample : imu_.samples) sample.specific_force *= 1.05;
  const SE3 before = map().At(keyframe_).cam_from_world;
  const auto attempts = ApplyToAll();
  EXPECT_FALSE(attempts.at(MapId{0}).found);
  EXPECT_NE(attempts.at(MapId{0}).reason, "");
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kFree);
  EXPECT_EQ(map().At(keyframe_).cam_from_world.Matrix(), before.Matrix());
}

TEST_F(InertialGaugeTest, TheBetterPosesAreAskedFor) {
  const SE3 elsewhere(Eigen::Quaterniond::Identity(), {1, 2, 3});
  const Trajectory path =
      PathIn(made_.atlas, MapId{0}, records_, [&](const FrameRecord&) { return elsewhere; });
  ASSERT_EQ(path.size(), records_.size());
  EXPECT_EQ(path[5].world_from_cam.Inverse().Matrix(), elsewhere.Matrix());
}

}  // namespace
}  // namespace deepuav
