#include "deepuav/inertial/alignment/mount_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kFrom_s = 1, kTo_s = 21, kRate_hz = 10;

/// Turns about one axis of the sensor, as on a gimbal, and hardly about the others.
struct OneAxisFlight : InertialFlight {
  Eigen::Vector3d Turn(double t) const override {
    return {0.002 * std::sin(3 * t), 0.0015 * std::cos(2 * t), 0.5 * std::sin(0.7 * t)};
  }
};

struct FlightWithoutTurns : InertialFlight {
  Eigen::Vector3d Turn(double) const override { return {0.1, 0.2, 0.3}; }
};

struct Scene {
  Scene(const InertialFlight& flight, const Eigen::Quaterniond& cam_from_imu,
        double clock_offset_s = 0) {
    Random random(3);
    path = flight.CameraPath(kFrom_s, kTo_s, kRate_hz, {cam_from_imu, {0.1, 0.05, -0.1}},
                             Sim3(0.2, RotationExp({0.5, -1, 0.2}), {1, 2, 3}));
    for (TimedPose& pose : path) {
      pose.world_from_cam = {
          pose.world_from_cam.rotation() * RotationExp(GaussianVector(0.03 * kDegree, &random)),
          pose.world_from_cam.translation()};
    }
    samples = flight.Samples(0, kTo_s + 1, 200);
    for (ImuSample& sample : samples) {
      sample.angular_velocity += Eigen::Vector3d(0.02, -0.01, 0.03) + GaussianVector(2e-3, &random);
      sample.time.nanoseconds -= std::llround(1e9 * clock_offset_s);
    }
  }

  std::optional<FoundMount> Find() const {
    return FindMount(path, ImuIntegrator(samples, {}, options.max_imu_gap_s), options);
  }

  Trajectory path;
  std::vector<ImuSample> samples;
  InertialOptions options;
};

double AngleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return RotationLog(a.conjugate() * b).norm();
}

TEST(MountSearch, TurnsAboutAllAxesTellAnyMountDespiteBiasAndClock) {
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(1.9, -0.4, 0.3), Eigen::Vector3d(-2, 2, 0.5), Eigen::Vector3d(0.1, 0, 0)}) {
    const Eigen::Quaterniond truth = RotationExp(turn);
    const auto found = Scene(InertialFlight(), truth, 0.04).Find();
    ASSERT_TRUE(found);
    EXPECT_FALSE(found->along_axes);
    EXPECT_LT(AngleBetween(found->cam_from_imu, truth), 0.3 * kDegree);
    EXPECT_LT(AngleBetween(found->cam_from_imu, truth), 4 * found->sigma_rad);
    EXPECT_NEAR(found->clock_offset_s, 0.04, 0.0051);
  }
}

TEST(MountSearch, WrongPosesWeighLittle) {
  const Eigen::Quaterniond truth = RotationExp({1.2, -0.7, 2});
  Scene scene(InertialFlight(), truth);
  Random random(8);
  for (size_t i = 0; i < scene.path.size(); i += 20) {
    SE3& pose = scene.path[i].world_from_cam;
    pose = {pose.rotation() * RotationExp(GaussianVector(0.3, &random)), pose.translation()};
  }
  const auto found = scene.Find();
  ASSERT_TRUE(found);
  EXPECT_LT(AngleBetween(found->cam_from_imu, truth), 1 * kDegree);
}

TEST(MountSearch, TurnsAboutOneAxisTellWhichOfTheCamerasAxesItLiesAlong) {
  Eigen::Matrix3d axes;
  axes << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  const Eigen::Quaterniond truth = Eigen::Quaterniond(axes) * RotationExp({0.004, 0.003, 0});
  const auto found = Scene(OneAxisFlight(), truth).Find();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->along_axes);
  EXPECT_LT(AngleBetween(found->cam_from_imu, Eigen::Quaterniond(axes)), 1e-9);
  EXPECT_NEAR(found->sigma_rad, 0.5 * kDegree, 1e-12);
}

TEST(MountSearch, TurnsAboutOneAxisDoNotTellASkewMount) {
  EXPECT_FALSE(Scene(OneAxisFlight(), RotationExp({0.6, 0.5, 0})).Find());
}

TEST(MountSearch, NothingIsToldWithoutTurnsSamplesOrPath) {
  EXPECT_FALSE(Scene(FlightWithoutTurns(), Eigen::Quaterniond::Identity()).Find());
  Scene scene(InertialFlight(), Eigen::Quaterniond::Identity());
  scene.samples.clear();
  EXPECT_FALSE(scene.Find());
  scene = Scene(InertialFlight(), Eigen::Quaterniond::Identity());
  scene.path.clear();
  EXPECT_FALSE(scene.Find());
}

TEST(MountSearch, SaysNoMoreThanItsOptionsAllow) {
  Scene gimbal(OneAxisFlight(), Eigen::Quaterniond::Identity());
  ASSERT_TRUE(gimbal.Find());
  gimbal.options.max_mount_doubt_deg = 0;
  EXPECT_FALSE(gimbal.Find()) << "nothing is taken to be along the axes";
  Scene free(InertialFlight(), RotationExp({1.9, -0.4, 0.3}), 0.02);
  free.options.max_clock_offset_s = 0;
  const auto found = free.Find();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->clock_offset_s, 0);
  free.options.max_tilt_sigma_deg = 0.9 * found->sigma_rad / kDegree;
  EXPECT_FALSE(free.Find());
}

TEST(MountSearch, AMirroredSensorIsNoMount) {
  Scene scene(InertialFlight(), Eigen::Quaterniond::Identity());
  for (ImuSample& sample : scene.samples) sample.angular_velocity.x() *= -1;
  EXPECT_FALSE(scene.Find());
}

}  // namespace
}  // namespace deepuav
