#include "deepuav/simulation/flight/quadrotor_path.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/simulation/flight/route.h"

namespace deepuav {
namespace {

const WindOptions kCalm{0, 0, 1, 6, 0, 0.1, 0.4};

std::vector<MinimumSnapCurve> BentCourse() {
  const std::vector<FlatOutput> values = {{0, 0, 10, 0.3}, {8, 2, 11, 1}, {12, 9, 14, 2.5},
                                          {3, 15, 12, 4},  {-4, 9, 9, 5}, {0, 0, 10, 6.5}};
  return {MinimumSnapCurve({0, 2, 4, 6, 8, 10}, values),
          MinimumSnapCurve({5, 7}, {values[5], values[5]})};
}

QuadrotorPath MakePath(bool gimbal, const WindOptions& wind, std::optional<Kidnap> kidnap = {}) {
  Random random(7);
  return QuadrotorPath(BentCourse(), {gimbal, 0.12}, WindJitter(wind, &random), kidnap);
}

TEST(QuadrotorPath, RatesAreTheDerivativesOfThePose) {
  WindOptions wind;
  wind.jitter_angle_deg = 2;
  for (const bool gimbal : {true, false}) {
    const QuadrotorPath path = MakePath(gimbal, wind);
    const double h = 1e-4;
    for (double t = 0.05; t < path.duration_s() - h; t += 0.0731) {
      const BodyState before = path.At(t - h), at = path.At(t), after = path.At(t + h);
      const Eigen::Vector3d velocity =
          (after.world_from_body.translation() - before.world_from_body.translation()) / (2 * h);
      const Eigen::Vector3d acceleration = (after.velocity_world - before.velocity_world) / (2 * h);
      const Eigen::Vector3d rate = RotationLog(before.world_from_body.rotation().conjugate() *
                                               after.world_from_body.rotation()) /
                                   (2 * h);
      EXPECT_LT((velocity - at.velocity_world).norm(), 1e-5) << t;
      EXPECT_LT((acceleration - at.acceleration_world).norm(), 1e-3) << t;
      EXPECT_LT((rate - at.angular_velocity_body).norm(), 1e-5) << t;
    }
  }
}

TEST(QuadrotorPath, AirframePointsItsThrustAlongTheForceItNeeds) {
  const QuadrotorPath path = MakePath(false, kCalm);
  double largest_tilt = 0;
  for (double t = 0; t < path.duration_s(); t += 0.1) {
    const BodyState state = path.At(t);
    const Eigen::Vector3d force = state.acceleration_world + Eigen::Vector3d(0, 0, kGravityMps2) +
                                  0.12 * state.velocity_world;
    const Eigen::Vector3d up = state.world_from_body.rotation() * Eigen::Vector3d::UnitZ();
    EXPECT_LT((up - force.normalized()).norm(), 1e-9);
    largest_tilt = std::max(largest_tilt, std::acos(up.z()));
  }
  EXPECT_GT(largest_tilt, 0.2);
}

TEST(QuadrotorPath, GimbalKeepsLevelAndYawSaysWhereXPoints) {
  const QuadrotorPath path = MakePath(true, kCalm);
  const Eigen::Matrix3d rotation = path.At(0).world_from_body.RotationMatrix();
  EXPECT_LT((rotation.col(0) - Eigen::Vector3d(std::cos(0.3), std::sin(0.3), 0)).norm(), 1e-9);
  for (double t = 0; t < path.duration_s(); t += 0.1)
    EXPECT_NEAR(path.At(t).world_from_body.RotationMatrix()(2, 2), 1, 1e-12);
}

TEST(QuadrotorPath, FliesItsCurvesOneAfterTheOther) {
  const QuadrotorPath path = MakePath(true, kCalm);
  EXPECT_DOUBLE_EQ(path.duration_s(), 12);
  EXPECT_LT((path.At(4).world_from_body.translation() - Eigen::Vector3d(12, 9, 14)).norm(), 1e-9);
  for (const double t : {10.0, 11.0, 12.0, 99.0})
    EXPECT_LT((path.At(t).world_from_body.translation() - Eigen::Vector3d(0, 0, 10)).norm(), 1e-9);
}

TEST(QuadrotorPath, KidnapGoesOnElsewhere) {
  const QuadrotorPath course = MakePath(true, kCalm);
  const QuadrotorPath path = MakePath(true, kCalm, Kidnap{3, 7});
  EXPECT_DOUBLE_EQ(path.duration_s(), 8);
  const auto place = [](const FlightPath& flight, double t) {
    return flight.At(t).world_from_body.translation();
  };
  EXPECT_EQ(place(path, 2.999), place(course, 2.999));
  EXPECT_EQ(place(path, 3), place(course, 7));
  EXPECT_EQ(place(path, 5), place(course, 9));
  EXPECT_GT((place(path, 3) - place(path, 2.999)).norm(), 5);
  EXPECT_THROW(MakePath(true, kCalm, Kidnap{13, 7}), Error);
  EXPECT_THROW(MakePath(true, kCalm, Kidnap{3, 12}), Error);
}

TEST(WindJitter, HasTheAskedDeviationInTheAskedBand) {
  Random random(8);
  const BandNoise noise(0.3, 2, 5, 0, &random);
  double sum = 0, velocity_sum = 0, mean = 0;
  constexpr int kSamples = 200000;
  for (int i = 0; i < kSamples; ++i) {
    const Swing swing = noise.At(i * 0.01);
    mean += swing.value.x() / kSamples;
    sum += swing.value.squaredNorm() / 3 / kSamples;
    velocity_sum += swing.velocity.squaredNorm() / 3 / kSamples;
  }
  EXPECT_NEAR(mean, 0, 1e-3);
  EXPECT_NEAR(std::sqrt(sum), 0.3, 3e-3);
  // The mean square frequency of a flat band from 2 to 5 Hz is 13 Hz^2.
  EXPECT_NEAR(std::sqrt(velocity_sum / sum) / (2 * M_PI), std::sqrt(13.0), 0.15);
}

// With displacements that fall as the square of the frequency, accelerations are flat.
TEST(WindJitter, FallsOffWithFrequency) {
  Random random(9);
  const BandNoise noise(0.01, 1, 8, 2, &random);
  double value = 0, acceleration = 0;
  constexpr int kSamples = 100000;
  for (int i = 0; i < kSamples; ++i) {
    const Swing swing = noise.At(i * 0.01);
    value += swing.value.squaredNorm() / 3 / kSamples;
    acceleration += swing.acceleration.squaredNorm() / 3 / kSamples;
  }
  EXPECT_NEAR(std::sqrt(value), 0.01, 2e-4);
  // The mean of f^-4 over the band is (1 - 8^-3) / 3 / 7.
  EXPECT_NEAR(std::sqrt(acceleration / value) / (4 * M_PI * M_PI), 1 / std::sqrt(0.04752), 1.2);
}

TEST(WindJitter, FollowsFromTheSeed) {
  Random first(1), again(1), other(2);
  const WindOptions options;
  const WindJitter a(options, &first), b(options, &again), c(options, &other);
  EXPECT_EQ(a.Position(3.3).value, b.Position(3.3).value);
  EXPECT_NE(a.Position(3.3).value, c.Position(3.3).value);
}

TEST(Route, KeepsTheLimits) {
  const MotionLimits limits{7, 2.5, 0.8};
  std::vector<FlatOutput> points = {
      {0, 0, 20, 0}, {60, 0, 20, 0}, {60, 40, 30, 1.6}, {0, 40, 30, 3.1}};
  points = Smooth(Resample(points, 1), 1, 25);
  const std::vector<MinimumSnapCurve> curves = FlyAlong(points, limits);
  ASSERT_EQ(curves.size(), 1);
  double speed = 0, acceleration = 0, yaw_rate = 0;
  for (double t = 0; t < curves[0].end_s(); t += 0.011) {
    const FlatState state = curves[0].At(t);
    speed = std::max(speed, state.velocity.head<3>().norm());
    acceleration = std::max(acceleration, state.acceleration.head<3>().norm());
    yaw_rate = std::max(yaw_rate, std::abs(state.velocity.w()));
  }
  EXPECT_LT(speed, limits.speed_m_s * 1.001);
  EXPECT_GT(speed, limits.speed_m_s * 0.7);
  EXPECT_LT(acceleration, limits.acceleration_m_s2 * 1.01);
  EXPECT_GT(acceleration, limits.acceleration_m_s2 * 0.5);
  EXPECT_LT(yaw_rate, limits.yaw_rate_rad_s * 1.001);
  EXPECT_LT((curves[0].At(1e9).value - points.back()).norm(), 1e-9);
}

// Of the curve from the polyline's points, in the plane of the polyline.
TEST(Route, StaysNearItsPoints) {
  std::vector<FlatOutput> circle;
  for (int i = 0; i <= 360; ++i) {
    const double angle = i * M_PI / 180;
    circle.emplace_back(40 * std::cos(angle), 40 * std::sin(angle), 30, angle);
  }
  const std::vector<FlatOutput> points = Smooth(Resample(circle, 1), 1, 18);
  const MinimumSnapCurve curve = FlyAlong(points, {6, 3, 1}).front();
  for (double t = 0; t < curve.end_s(); t += 0.1)
    EXPECT_NEAR(curve.At(t).value.head<2>().norm(), 40, 0.3) << t;
}

TEST(Route, TurnsTheShorterWayBetweenLegsAndPauses) {
  const FlatOutput a(0, 0, 10, 3), b(20, 0, 10, 3), c(20, 20, 10, -3);
  const std::vector<MinimumSnapCurve> curves =
      FlyLegs({{{a, b}, 2, 0.5}, {{{20, 0, 10, -3}, c}, 0, 0}}, {5, 2, 1});
  ASSERT_EQ(curves.size(), 5);  // leg, pause, turn, turn to the next leg, leg
  EXPECT_DOUBLE_EQ(curves[1].end_s(), 2);
  EXPECT_NEAR(curves[2].At(1e9).value.w(), 3.5, 1e-9);
  EXPECT_NEAR(curves[4].At(1e9).value.w(), 2 * M_PI - 3, 1e-9);
  for (size_t i = 1; i < curves.size(); ++i)
    EXPECT_LT((curves[i].At(-1).value - curves[i - 1].At(1e9).value).norm(), 1e-9) << i;
}

}  // namespace
}  // namespace deepuav
