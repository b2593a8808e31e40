#include "deepuav/autopilot/inertial_prediction.h"

#include <gtest/gtest.h>

#include "support/inertial_flight.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

constexpr double kImageInterval_s = 0.1, kLatency_s = 0.08, kTold_s = 0.025, kSample_s = 0.005;
constexpr double kPositionNoise_m = 0.003, kRotationNoise_rad = 0.001;
const Vector3d kGyroscopeBias(0.02, -0.03, 0.01), kAccelerometerBias(0.2, -0.1, 0.15);

int64_t At(double t) { return AtSeconds(t).nanoseconds; }

/// A vehicle that speeds up and turns all the time; half a turn about x makes z up z down.
class InertialPredictionTest : public testing::Test {
 protected:
  SE3 LocalFromBody(double t) const {
    return SE3(Eigen::Quaterniond(0, 1, 0, 0), Vector3d::Zero()) * flight_.WorldFromImu(t);
  }
  Vector3d VelocityLocal(double t) const {
    return Eigen::Quaterniond(0, 1, 0, 0) * flight_.Velocity(t);
  }

  BodyPose PoseAt(double t) {
    BodyPose pose;
    Vector6d noise;
    for (int i = 0; i < 6; ++i)
      noise[i] = random_.Gaussian(i < 3 ? kPositionNoise_m : kRotationNoise_rad);
    pose.local_from_body = local_from_before_ * MovedBy(LocalFromBody(t), noise);
    pose.covariance = DiagonalOf(kPositionNoise_m, kRotationNoise_rad);
    pose.covariance_is_known = true;
    return pose;
  }
  ImuSample SampleAt(double t) {
    return {AtSeconds(t),
            sensor_from_body_ * flight_.AngularVelocity(t) + kGyroscopeBias +
                GaussianVector(0.02, &random_),
            sensor_from_body_ * flight_.SpecificForce(t) + kAccelerometerBias +
                GaussianVector(0.2, &random_)};
  }

  /// Images come late, samples sooner; `ask` is called whenever an autopilot is told.
  template <typename Ask>
  void Fly(double from_s, double to_s, Ask&& ask) {
    double image = from_s, sample = from_s;
    for (double t = from_s; t < to_s; t += kTold_s) {
      for (; has_samples_ && sample + sample_latency_s_ <= t; sample += kSample_s) {
        const ImuSample measured = SampleAt(sample);
        inertial_.AddInertial(measured);
      }
      for (; image + kLatency_s <= t; image += kImageInterval_s) {
        const BodyPose pose = PoseAt(image);
        plain_.Add(At(image), pose);
        inertial_.Add(At(image), pose);
      }
      ask(t);
    }
  }
  void Fly(double from_s, double to_s) {
    Fly(from_s, to_s, [](double) {});
  }

  struct Errors {
    double position_m = 0, rotation_rad = 0, velocity_m_s = 0, turn_rate_rad_s = 0;
    double chi_square = 0;           ///< Of all twelve, a degree of freedom...
    double rotation_chi_square = 0;  ///< ...and of the rotation's.
    int count = 0;
  };
  void Count(const MotionPredictor& predictor, double t, Errors* errors) const {
    const std::optional<BodyMotion> motion = predictor.At(At(t));
    if (!motion) return;
    const SE3 truth = local_from_before_ * LocalFromBody(t);
    Eigen::Matrix<double, 12, 1> error;
    error << PoseResidual(motion->local_from_body, truth),
        local_from_before_.rotation() * VelocityLocal(t) - motion->velocity_local,
        flight_.AngularVelocity(t) - motion->turn_rate_body;
    errors->position_m += error.head<3>().squaredNorm();
    errors->rotation_rad += error.segment<3>(3).squaredNorm();
    errors->velocity_m_s += error.segment<3>(6).squaredNorm();
    errors->turn_rate_rad_s += error.tail<3>().squaredNorm();
    errors->chi_square += error.dot(motion->covariance.llt().solve(error)) / 12;
    const Vector3d turn = error.segment<3>(3);
    const Eigen::Matrix3d turn_covariance = motion->covariance.block<3, 3>(3, 3);
    errors->rotation_chi_square += turn.dot(turn_covariance.llt().solve(turn)) / 3;
    ++errors->count;
  }

  /// Root mean squares, for who asks for the tests' properties (--gtest_output).
  static void Record(const std::string& name, const Errors& errors) {
    const auto record = [&](const char* what, double sum) {
      RecordProperty(name + what, std::to_string(std::sqrt(sum / errors.count)));
    };
    record("_position_m", errors.position_m);
    record("_rotation_rad", errors.rotation_rad);
    record("_velocity_m_s", errors.velocity_m_s);
    record("_turn_rate_rad_s", errors.turn_rate_rad_s);
  }

  const InertialFlight flight_;
  Random random_{4};
  bool has_samples_ = true;
  double sample_latency_s_ = 0;
  Eigen::Quaterniond sensor_from_body_ = Eigen::Quaterniond::Identity();
  SE3 local_from_before_;
  ConstantVelocity plain_;
  InertialPrediction inertial_;
};

TEST_F(InertialPredictionTest, ForetellsWhatConstantVelocityCannot) {
  Errors plain, inertial;
  Fly(0, 30, [&](double t) {
    if (t < 3) return;
    Count(plain_, t, &plain);
    Count(inertial_, t, &inertial);
  });
  ASSERT_GT(inertial.count, 1000);
  Record("plain", plain);
  Record("inertial", inertial);
  EXPECT_EQ(inertial.count, plain.count);
  EXPECT_TRUE(inertial_.uses_samples());
  EXPECT_LT(inertial.position_m, 0.25 * plain.position_m);
  EXPECT_LT(inertial.rotation_rad, 0.25 * plain.rotation_rad);
  EXPECT_LT(inertial.velocity_m_s, 0.25 * plain.velocity_m_s);
  EXPECT_LT(inertial.turn_rate_rad_s, 0.5 * plain.turn_rate_rad_s);
  // What it says of itself is neither too good nor far too bad.
  EXPECT_LT(inertial.chi_square / inertial.count, 1.5);
  EXPECT_GT(inertial.chi_square / inertial.count, 0.1);
}

TEST_F(InertialPredictionTest, SaysHowSureItIsWhereSamplesAreLate) {
  double from = 0;
  for (const double latency_s : {0.01, 0.04}) {
    sample_latency_s_ = latency_s;
    Errors errors;
    Fly(from, from + 15, [&](double t) {
      if (t < from + 3) return;
      Count(inertial_, t, &errors);
      const Matrix12d by_samples = inertial_.At(At(t))->covariance,
                      without = plain_.At(At(t))->covariance;
      EXPECT_LT((by_samples.diagonal().array() / without.diagonal().array()).maxCoeff(), 1);
    });
    ASSERT_TRUE(inertial_.uses_samples());
    EXPECT_LT(errors.chi_square / errors.count, 1.5) << latency_s;
    EXPECT_LT(errors.rotation_chi_square / errors.count, 1.5) << latency_s;
    from += 20;
  }
}

TEST_F(InertialPredictionTest, IsConstantVelocityWithoutSamples) {
  has_samples_ = false;
  Fly(0, 5, [&](double t) {
    const std::optional<BodyMotion> plain = plain_.At(At(t)), inertial = inertial_.At(At(t));
    ASSERT_EQ(plain.has_value(), inertial.has_value());
    if (!plain) return;
    EXPECT_EQ(plain->local_from_body.Matrix(), inertial->local_from_body.Matrix());
    EXPECT_EQ(plain->covariance, inertial->covariance);
  });
  EXPECT_FALSE(inertial_.uses_samples());
}

TEST_F(InertialPredictionTest, SamplesMayStopAndComeBack) {
  Fly(0, 5);
  has_samples_ = false;
  Fly(5, 7);
  const std::optional<BodyMotion> without = inertial_.At(At(7));
  ASSERT_TRUE(without);
  EXPECT_EQ(without->local_from_body.Matrix(), plain_.At(At(7))->local_from_body.Matrix());
  has_samples_ = true;
  Errors plain, inertial;
  Fly(7, 12, [&](double t) {
    if (t < 8.5) return;
    Count(plain_, t, &plain);
    Count(inertial_, t, &inertial);
  });
  EXPECT_LT(inertial.position_m, 0.25 * plain.position_m);
}

TEST_F(InertialPredictionTest, ASensorThatIsMountedOtherwiseIsNotFollowed) {
  sensor_from_body_ = Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitX());
  Fly(0, 10, [&](double t) {
    if (t < 2) return;
    EXPECT_FALSE(inertial_.uses_samples());
    EXPECT_EQ(inertial_.At(At(t))->local_from_body.Matrix(),
              plain_.At(At(t))->local_from_body.Matrix());
  });
}

TEST_F(InertialPredictionTest, KnowsItsMotionWhereTheFrameMoved) {
  Fly(0, 10);
  const double image = 9.95;
  ASSERT_TRUE(inertial_.Expects(At(image), PoseAt(image)));
  local_from_before_ = SE3(RotationExp({0, 0, 0.7}), Vector3d(5, -3, 1));
  EXPECT_FALSE(inertial_.Expects(At(image), PoseAt(image)));
  inertial_.Jump(At(image), PoseAt(image));
  Errors errors;
  Count(inertial_, image + 0.04, &errors);
  ASSERT_EQ(errors.count, 1);
  EXPECT_LT(std::sqrt(errors.position_m), 0.03);
  EXPECT_LT(std::sqrt(errors.velocity_m_s), 0.2);
}

TEST_F(InertialPredictionTest, ForgetsAll) {
  Fly(0, 5);
  inertial_.Forget();
  EXPECT_FALSE(inertial_.At(At(5)));
  EXPECT_FALSE(inertial_.uses_samples());
}

/// The filter after it was moved by an error and went on.
InertialFilter Integrated(const InertialFilter& start, const Eigen::Matrix<double, 15, 1>& error,
                          const InertialErrors& errors) {
  InertialFilter filter = start;
  filter.local_from_body = MovedBy(start.local_from_body, error.head<6>());
  filter.velocity_local += error.segment<3>(6);
  filter.gyroscope_bias += error.segment<3>(9);
  filter.accelerometer_bias += error.tail<3>();
  Integrate({{}, {0.5, -0.8, 1.2}, {1, -2, -9}}, At(0.01), errors, &filter);
  return filter;
}

TEST(InertialFilter, ErrorsGrowAsItsCovarianceSays) {
  const InertialErrors exact{0, 0, 0, 0, 0, 0, 0};
  InertialFilter start;
  start.time_ns = At(0);
  start.local_from_body = SE3(RotationExp({0.3, -0.2, 1}), Vector3d(1, 2, 3));
  start.velocity_local = {3, -1, 0.5};
  start.gyroscope_bias = {0.01, 0.02, -0.03};
  start.accelerometer_bias = {0.1, -0.2, 0.3};
  start.covariance.setZero();
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 15; ++i) {
    Eigen::Matrix<double, 15, 1> error = Eigen::Matrix<double, 15, 1>::Zero();
    error[i] = kStep;
    const InertialFilter more = Integrated(start, error, exact),
                         less = Integrated(start, -error, exact);
    Eigen::Matrix<double, 15, 1> change;
    change << PoseResidual(less.local_from_body, more.local_from_body),
        more.velocity_local - less.velocity_local, more.gyroscope_bias - less.gyroscope_bias,
        more.accelerometer_bias - less.accelerometer_bias;
    change /= 2 * kStep;
    InertialFilter unsure = start;
    unsure.covariance(i, i) = 1;
    const Matrix15d grown =
        Integrated(unsure, Eigen::Matrix<double, 15, 1>::Zero(), exact).covariance;
    EXPECT_LT((grown - change * change.transpose()).cwiseAbs().maxCoeff(), 2e-3) << i;
  }
}

}  // namespace
}  // namespace deepuav
