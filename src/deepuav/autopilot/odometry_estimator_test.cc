#include "deepuav/autopilot/odometry_estimator.h"

#include <gtest/gtest.h>

#include "deepuav/autopilot/constant_velocity.h"
#include "deepuav/autopilot/mount.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;
using Silence = OdometryEstimator::Silence;

constexpr int64_t kMs = 1'000'000, kStart = 5'000 * kMs, kInterval = 50 * kMs;
const Vector3d kVelocity(3, -1, 0.5);     // Local frame, m/s.
const Vector3d kTurnRate(0.1, 0.2, 0.5);  // Body, rad/s.

double Seconds(int64_t ns) { return 1e-9 * static_cast<double>(ns); }

SE3 BodyFromCam() { return {ParseMount("0,-20,0"), {0.2, 0, 0.1}}; }

/// A body that turns and flies steadily.
SE3 LocalFromBody(int64_t time_ns) {
  const double t = Seconds(time_ns - kStart);
  return {RotationExp({0.2, -0.1, 1}) * RotationExp(t * kTurnRate),
          Vector3d(1, 2, -10) + t * kVelocity};
}

/// As seen in a metric map: half a turn about x lies between z down and z up.
SE3 CamFromMap(const SE3& local_from_body) {
  const SE3 local_from_map(Eigen::Quaterniond(0, 1, 0, 0), Vector3d::Zero());
  return (local_from_map.Inverse() * local_from_body * BodyFromCam()).Inverse();
}

Matrix6d Information() { return 1e6 * Matrix6d::Identity(); }

LocatedImage ImageAt(int64_t time_ns) {
  return {time_ns, MapId{0}, 0, CamFromMap(LocalFromBody(time_ns)), Information(), 80};
}

class OdometryEstimatorTest : public testing::Test {
 protected:
  /// `count` images on, and the time of the last.
  int64_t Fly(int count) {
    for (int i = 0; i < count; ++i) {
      estimator_.Add(ImageAt(next_), MetricFromMap{});
      next_ += kInterval;
    }
    return next_ - kInterval;
  }
  /// An image as if the body were beside its course.
  void AddMoved(const Vector3d& offset) {
    LocatedImage image = ImageAt(next_);
    image.cam_from_map =
        CamFromMap(SE3(Eigen::Quaterniond::Identity(), offset) * LocalFromBody(next_));
    estimator_.Add(image, MetricFromMap{});
  }
  uint8_t Resets(int64_t time_ns) { return estimator_.At(time_ns).odometry->reset_counter; }

  OdometryEstimator estimator_{BodyFromCam(), {}, std::make_unique<ConstantVelocity>()};
  int64_t next_ = kStart;
};

TEST_F(OdometryEstimatorTest, PredictsBetweenImages) {
  const int64_t last = Fly(40);
  for (const int64_t ahead : {int64_t{0}, 20 * kMs, 45 * kMs, 200 * kMs}) {
    const auto answer = estimator_.At(last + ahead);
    ASSERT_TRUE(answer.odometry);
    EXPECT_EQ(answer.why, Silence::kNone);
    const Odometry& odometry = *answer.odometry;
    EXPECT_EQ(odometry.time_ns, last + ahead);
    const SE3 truth = LocalFromBody(last + ahead);
    const SE3 error = truth.Inverse() * odometry.local_from_body;
    EXPECT_LT(error.translation().norm(), 0.01) << ahead;
    EXPECT_LT(error.Angle(), 0.01) << ahead;
    EXPECT_LT((odometry.turn_rate_body - kTurnRate).norm(), 0.02);
    const Vector3d velocity_body = truth.rotation().conjugate() * kVelocity;
    EXPECT_LT((odometry.velocity_body - velocity_body).norm(), 0.05);
    EXPECT_EQ(odometry.quality, 80);
    EXPECT_EQ(odometry.reset_counter, 0);
  }
}

TEST_F(OdometryEstimatorTest, CovariancesGrowWithTheTimeSinceTheImage) {
  const int64_t last = Fly(20);
  const Odometry now = *estimator_.At(last).odometry,
                 later = *estimator_.At(last + 200 * kMs).odometry;
  for (const Matrix6d* covariance : {&now.pose_covariance, &now.velocity_covariance}) {
    ASSERT_TRUE(covariance->allFinite());
    EXPECT_GT(covariance->llt().matrixL().toDenseMatrix().diagonal().minCoeff(), 0);
  }
  EXPECT_LT(std::sqrt(now.pose_covariance(0, 0)), 0.003);
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(later.pose_covariance(i, i), now.pose_covariance(i, i));
    EXPECT_GT(later.velocity_covariance(i, i), now.velocity_covariance(i, i));
  }
}

TEST_F(OdometryEstimatorTest, TheScalesUncertaintyGrowsWithDistanceAndSpeed) {
  MetricFromMap metric;
  metric.scale_sigma = 0.02;
  for (int i = 0; i < 20; ++i, next_ += kInterval) estimator_.Add(ImageAt(next_), metric);
  const Odometry odometry = *estimator_.At(next_ - kInterval).odometry;
  const double x = odometry.local_from_body.translation().x(), v = odometry.velocity_body.norm();
  EXPECT_GT(odometry.pose_covariance(0, 0), 0.02 * 0.02 * x * x);
  EXPECT_GT((odometry.velocity_covariance.topLeftCorner<3, 3>().trace()), 0.02 * 0.02 * v * v);
}

TEST_F(OdometryEstimatorTest, UnknownCovariancesAreNotANumber) {
  for (int i = 0; i < 20; ++i, next_ += kInterval) {
    LocatedImage image = ImageAt(next_);
    image.information.setZero();
    estimator_.Add(image, MetricFromMap{});
  }
  const Odometry odometry = *estimator_.At(next_ - kInterval).odometry;
  EXPECT_TRUE(odometry.pose_covariance.array().isNaN().all());
  EXPECT_TRUE(odometry.velocity_covariance.array().isNaN().all());
  EXPECT_LT(
      (odometry.local_from_body.translation() - LocalFromBody(next_ - kInterval).translation())
          .norm(),
      0.02);
}

TEST_F(OdometryEstimatorTest, EveryCorrectionOfTheMapCountsOnce) {
  int64_t last = Fly(20);
  const Vector3d velocity = estimator_.At(last).odometry->velocity_body;
  LocatedImage image = ImageAt(next_);
  image.map_revision = 1;
  const SE3 moved = SE3(RotationExp({0, 0, 0.3}), {2, 0, 0}) * LocalFromBody(next_);
  image.cam_from_map = CamFromMap(moved);
  estimator_.Add(image, MetricFromMap{});
  const Odometry odometry = *estimator_.At(next_).odometry;
  EXPECT_EQ(odometry.reset_counter, 1);
  // It is there at once, and the body flies on as before.
  EXPECT_LT((moved.Inverse() * odometry.local_from_body).translation().norm(), 1e-6);
  EXPECT_LT((odometry.velocity_body - velocity).norm(), 0.1);
  image.time_ns = next_ += kInterval;
  estimator_.Add(image, MetricFromMap{});
  EXPECT_EQ(Resets(next_), 1);
  image.time_ns = next_ += kInterval;
  image.map = MapId{1};
  estimator_.Add(image, MetricFromMap{});
  EXPECT_EQ(Resets(next_), 2);
}

TEST_F(OdometryEstimatorTest, AChangeOfGaugeCountsWhereItMovesTheBody) {
  Fly(20);
  MetricFromMap metric;
  metric.metric_from_map = Sim3(1.0001, Eigen::Quaterniond::Identity(), Vector3d::Zero());
  estimator_.Add(ImageAt(next_), metric);
  EXPECT_EQ(Resets(next_), 0);
  metric.metric_from_map = Sim3(1.1, Eigen::Quaterniond::Identity(), Vector3d::Zero());
  next_ += kInterval;
  estimator_.Add(ImageAt(next_), metric);
  EXPECT_EQ(Resets(next_), 1);
  metric.origin = GeoPoint{47, 8, 400};
  next_ += kInterval;
  estimator_.Add(ImageAt(next_), metric);
  EXPECT_EQ(Resets(next_), 2);
  EXPECT_EQ(estimator_.At(next_).origin->latitude_deg, 47);
}

TEST_F(OdometryEstimatorTest, APoseThatNoMotionLeadsToIsAJump) {
  Fly(20);
  const Vector3d velocity = estimator_.At(next_).odometry->velocity_body;
  AddMoved({2, 0, 0});
  EXPECT_FALSE(estimator_.At(next_).odometry) << "how it moves there is not known yet";
  next_ += kInterval;
  AddMoved({2, 0, 0});
  EXPECT_EQ(Resets(next_), 1);
  EXPECT_LT((estimator_.At(next_).odometry->velocity_body - velocity).norm(), 0.3);
}

TEST_F(OdometryEstimatorTest, ALargeStepIsAJumpHoweverLateTheImage) {
  for (const double offset_m : {0.15, 0.6}) {
    Fly(20);
    const uint8_t before = Resets(next_);
    next_ += 8 * kInterval;
    AddMoved({0, offset_m, 0});
    next_ += kInterval;
    AddMoved({0, offset_m, 0});
    EXPECT_EQ(Resets(next_) - before, offset_m > 0.3) << offset_m;
    next_ += 20 * kInterval;
  }
}

TEST_F(OdometryEstimatorTest, WhatALateImageMovesOfWhatWasToldIsAJump) {
  for (const double latency_s : {0.02, 0.45}) {
    Fly(20);
    const auto told_ns = next_ + static_cast<int64_t>(1e9 * latency_s);
    const auto before = estimator_.At(told_ns).odometry;
    ASSERT_TRUE(before);
    // Stopped at once: by then the body is still near where it was expected, but not later on.
    AddMoved({-0.1, 0, 0});
    const auto after = estimator_.At(told_ns).odometry;
    ASSERT_TRUE(after);
    const double step_m =
        (after->local_from_body.translation() - before->local_from_body.translation()).norm();
    EXPECT_EQ(step_m > 0.3, latency_s > 0.3) << step_m;
    EXPECT_EQ(after->reset_counter - before->reset_counter, step_m > 0.3) << step_m;
    next_ += 40 * kInterval;
  }
}

TEST_F(OdometryEstimatorTest, ManoeuvresAreNoJumps) {
  Fly(20);
  SE3 pose = LocalFromBody(next_);
  Vector3d velocity = kVelocity;
  for (int i = 0; i < 40; ++i, next_ += kInterval) {
    LocatedImage image = ImageAt(next_);
    image.cam_from_map = CamFromMap(pose);
    estimator_.Add(image, MetricFromMap{});
    velocity.y() += (i % 20 < 10 ? 15 : -15) * Seconds(kInterval);  // m/s^2
    pose = SE3(pose.rotation() * RotationExp({i % 8 < 4 ? 0.1 : -0.1, 0, 0}),
               pose.translation() + Seconds(kInterval) * velocity);
  }
  EXPECT_EQ(Resets(next_ - kInterval), 0);
}

TEST_F(OdometryEstimatorTest, TheCounterBeginsAnewAfter255) {
  Fly(2);
  for (int i = 1; i <= 256; ++i, next_ += kInterval) {
    LocatedImage image = ImageAt(next_);
    image.map_revision = i;
    estimator_.Add(image, MetricFromMap{});
  }
  EXPECT_EQ(Resets(next_ - kInterval), 0);
}

TEST_F(OdometryEstimatorTest, SaysNothingWithoutScale) {
  EXPECT_EQ(estimator_.At(kStart).why, Silence::kNoImage);
  estimator_.Add(ImageAt(kStart), std::nullopt);
  EXPECT_EQ(estimator_.At(kStart).why, Silence::kNoScale);
  EXPECT_FALSE(estimator_.At(kStart).odometry);
  Fly(3);
  next_ += kInterval;
  EXPECT_TRUE(estimator_.At(next_).odometry);
  estimator_.Add(ImageAt(next_), std::nullopt);  // Another map, as after a loss.
  EXPECT_EQ(estimator_.At(next_).why, Silence::kNoScale);
  EXPECT_FALSE(estimator_.At(next_).odometry);
}

TEST_F(OdometryEstimatorTest, FallsSilentWhereTheCameraIsLost) {
  const int64_t last = Fly(20);
  estimator_.Lost();
  EXPECT_TRUE(estimator_.At(last + 400 * kMs).odometry);
  EXPECT_FALSE(estimator_.At(last + 600 * kMs).odometry);
  EXPECT_EQ(estimator_.At(last + 600 * kMs).why, Silence::kLost);
  next_ = last + 3000 * kMs;
  const int64_t again = Fly(2);
  EXPECT_EQ(Resets(again), 1) << "where it goes on may be elsewhere";
}

TEST_F(OdometryEstimatorTest, WhereALostCameraIsFoundElsewhereIsAJump) {
  for (const double offset_m : {0.01, 0.3}) {
    Fly(20);
    const uint8_t before = Resets(next_);
    estimator_.Lost();
    next_ += 6 * kInterval;
    AddMoved({offset_m, 0, 0});
    next_ += kInterval;
    AddMoved({offset_m, 0, 0});
    EXPECT_EQ(Resets(next_) - before, offset_m > 0.05) << offset_m;
    next_ += kInterval;
  }
}

TEST_F(OdometryEstimatorTest, TimesThatGoBackBeginAnew) {
  Fly(20);
  next_ = kStart - 3'600'000 * kMs;
  const int64_t last = Fly(3);
  ASSERT_TRUE(estimator_.At(last).odometry);
  EXPECT_EQ(Resets(last), 1);
}

TEST(EulerAngles, AreRollPitchYaw) {
  const Vector3d angles(0.3, -0.4, 2.5);
  using Eigen::AngleAxisd;
  const Eigen::Quaterniond rotation = AngleAxisd(angles.z(), Vector3d::UnitZ()) *
                                      AngleAxisd(angles.y(), Vector3d::UnitY()) *
                                      AngleAxisd(angles.x(), Vector3d::UnitX());
  EXPECT_TRUE(EulerAngles(rotation).isApprox(angles));
}

/// A body that points straight up has no roll and yaw; its place is known all the same.
TEST(OdometryEstimator, NoAnglesStraightUp) {
  OdometryEstimator estimator(SE3(), {}, std::make_unique<ConstantVelocity>());
  const SE3 up(RotationExp({0, M_PI / 2, 0}), {1, 2, 3});
  const SE3 local_from_map(Eigen::Quaterniond(0, 1, 0, 0), Vector3d::Zero());
  for (int i = 0; i < 3; ++i) {
    estimator.Add({kStart + i * kInterval, MapId{0}, 0, (local_from_map.Inverse() * up).Inverse(),
                   Information(), 50},
                  MetricFromMap{});
  }
  const Odometry odometry = *estimator.At(kStart + 2 * kInterval).odometry;
  EXPECT_TRUE((odometry.pose_covariance.topLeftCorner<3, 3>().allFinite()));
  EXPECT_TRUE(std::isnan(odometry.pose_covariance(3, 3)));
}

}  // namespace
}  // namespace deepuav
