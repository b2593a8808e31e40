#include "deepuav/sensors/orientation_prior.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"
#include "deepuav/sensors/georeference.h"
#include "support/flights.h"

namespace deepuav {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kImages = 40;
const Sim3 kMapFromLocal(0.05, RotationExp({0.3, -1.2, 0.4}), {1, -2, 3});
const Eigen::Quaterniond kLocalFromMap = kMapFromLocal.rotation().conjugate();

Eigen::Quaterniond Shake(double sigma_rad, Random* random) {
  return RotationExp(
      {random->Gaussian(sigma_rad), random->Gaussian(sigma_rad), random->Gaussian(sigma_rad)});
}

std::vector<AttitudeSample> AttitudesOf(const Trajectory& flight, double sigma_rad,
                                        Random* random) {
  std::vector<AttitudeSample> attitudes;
  for (const TimedPose& pose : flight)
    attitudes.push_back({pose.time, Shake(sigma_rad, random) * pose.world_from_cam.rotation()});
  return attitudes;
}

class OrientationPriorTest : public ::testing::Test {
 protected:
  OrientationAttempt Find() const {
    return OrientationByAttitudes(MoveTrajectory(kMapFromLocal, flight_), attitudes_, noise_);
  }

  Random random_{5};
  Trajectory flight_ = MakeFlight(kImages, 0.5);
  std::vector<AttitudeSample> attitudes_ = AttitudesOf(flight_, 0.3 * kDegree, &random_);
  AttitudeNoise noise_;
};

TEST_F(OrientationPriorTest, ExactAttitudesGiveTheExactOrientation) {
  attitudes_ = AttitudesOf(flight_, 0, &random_);
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(attempt.found->local_from_world.angularDistance(kLocalFromMap), 1e-7);
  EXPECT_NEAR(attempt.found->tilt_sigma_rad, noise_.tilt_sigma_deg * kDegree, 1e-9);
}

TEST_F(OrientationPriorTest, AFifthMayBeWrong) {
  for (size_t i = 0; i < attitudes_.size(); i += 5)
    attitudes_[i].enu_from_cam = Shake(1, &random_) * attitudes_[i].enu_from_cam;
  const auto attempt = Find();
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(attempt.found->local_from_world.angularDistance(kLocalFromMap), 1 * kDegree);
}

TEST_F(OrientationPriorTest, ImagesWithoutAnglesAreNoMatter) {
  for (size_t i = 0; i < attitudes_.size(); i += 2) attitudes_[i].time.nanoseconds += 1;
  EXPECT_TRUE(Find().found);
  attitudes_.resize(4);  // Two of them on the path.
  const auto few = Find();
  EXPECT_FALSE(few.found);
  EXPECT_NE(few.reason.find("expected at least 3"), std::string::npos) << few.reason;
}

TEST_F(OrientationPriorTest, AnglesThatContradictOneAnotherAreRefused) {
  // As of a gimbal whose angles are of the airframe, which turns.
  for (size_t i = 0; i < attitudes_.size(); ++i)
    attitudes_[i].enu_from_cam = RotationExp({0, 0, 0.3 * static_cast<double>(i)});
  const auto attempt = Find();
  EXPECT_FALSE(attempt.found);
  EXPECT_NE(attempt.reason.find("agree"), std::string::npos) << attempt.reason;
}

TEST_F(OrientationPriorTest, TwoHalvesThatContradictEachOtherAreRefused) {
  for (size_t i = 1; i < attitudes_.size(); i += 2)
    attitudes_[i].enu_from_cam = RotationExp({0, 0, 1}) * attitudes_[i].enu_from_cam;
  EXPECT_FALSE(Find().found);
}

/// Along the camera's x axis, where fixes alone leave the turn about the line open.
class StraightFlightTest : public OrientationPriorTest {
 protected:
  StraightFlightTest() {
    for (TimedPose& pose : flight_) {
      const double x = 5 * SecondsBetween(flight_.front().time, pose.time);
      pose.world_from_cam = SE3(RotationExp({M_PI + 0.4, 0, 0}), Eigen::Vector3d(x, 0, 60));
    }
    attitudes_ = AttitudesOf(flight_, 0.3 * kDegree, &random_);
    for (const TimedPose& pose : flight_) {
      LocalFix& fix = fixes_.emplace_back();
      fix = {pose.time, pose.world_from_cam.translation(), Eigen::Vector3d::Constant(0.5), true};
      for (double& value : fix.position_m) value += random_.Gaussian(0.5);
    }
  }
  GeoreferenceAttempt Place(const PlacePriors& priors) const {
    return FindGeoreference(MoveTrajectory(kMapFromLocal, flight_), fixes_, Eigen::Vector3d::Zero(),
                            {}, {}, {}, priors);
  }
  double Off(const GeoreferenceAttempt& attempt) const {
    return attempt.found->local_from_world.rotation().angularDistance(kLocalFromMap);
  }

  std::vector<LocalFix> fixes_;
};

TEST_F(StraightFlightTest, AttitudesTellTheTurnAboutTheLine) {
  EXPECT_FALSE(Place({}).found);
  const auto attempt = Place({.orientation = Find().found});
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(Off(attempt), 0.5 * kDegree);
  EXPECT_NEAR(attempt.found->turn_sigma_rad(), noise_.tilt_sigma_deg * kDegree, 0.2 * kDegree);
}

TEST_F(StraightFlightTest, TheFixesTellTheHeadingThatACompassSaysWrong) {
  for (AttitudeSample& attitude : attitudes_)
    attitude.enu_from_cam = RotationExp({0, 0, 12 * kDegree}) * attitude.enu_from_cam;
  const auto attempt = Place({.orientation = Find().found});
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_LT(Off(attempt), 0.7 * kDegree);
}

TEST_F(StraightFlightTest, ComesOutUprightUnderAnyHeadingOfTheCompass) {
  for (int heading_deg = -60; heading_deg <= 60; heading_deg += 5) {
    std::vector<AttitudeSample> attitudes = attitudes_;
    for (AttitudeSample& attitude : attitudes)
      attitude.enu_from_cam = RotationExp({0, 0, heading_deg * kDegree}) * attitude.enu_from_cam;
    std::swap(attitudes, attitudes_);
    const auto attempt = Place({.orientation = Find().found});
    std::swap(attitudes, attitudes_);
    ASSERT_TRUE(attempt.found) << attempt.reason;
    const Eigen::Vector3d up = attempt.found->local_from_world.rotation() *
                               (kMapFromLocal.rotation() * Eigen::Vector3d::UnitZ());
    EXPECT_GT(up.z(), 0.9) << heading_deg;
  }
}

TEST_F(StraightFlightTest, AMeanErrorOfTheGimbalCountsWithItsStandardDeviation) {
  for (AttitudeSample& attitude : attitudes_)  // About the line: nothing else tells it.
    attitude.enu_from_cam = RotationExp({2 * kDegree, 0, 0}) * attitude.enu_from_cam;
  const auto attempt = Place({.orientation = Find().found});
  ASSERT_TRUE(attempt.found) << attempt.reason;
  EXPECT_NEAR(Off(attempt), 2 * kDegree, 0.3 * kDegree);
  EXPECT_LT(Off(attempt), 3 * attempt.found->turn_sigma_rad());
}

}  // namespace
}  // namespace deepuav
