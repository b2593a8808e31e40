#include "deepuav/system/sensors/georeferencing.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/finish/pose_covariances.h"
#include "deepuav/system/testing/georeferencing_fixture.h"

namespace deepuav {
namespace {

TEST_F(GeoreferencingTest, AMapComesToItsPlaceOnEarth) {
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_EQ(report.used, kRows * kColumns);
  EXPECT_LT(Error(report.origin), 0.2);
  const Gauge gauge = made_.atlas.GaugeOf(MapId{0});
  EXPECT_EQ(gauge.kind, GaugeKind::kGeoreferenced);
  EXPECT_EQ(gauge.origin.latitude_deg, report.origin.latitude_deg);
  EXPECT_LT(gauge.scale_sigma, 0.02);
}

TEST_F(GeoreferencingTest, FixesTakeOutTheDriftOfTheCamera) {
  Drift(0.5);
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_LT(Error(report.origin), 0.25);
  EXPECT_GT(report.height_steps, 10);
}

TEST_F(GeoreferencingTest, FixesToCentimetresLeaveNoDrift) {
  Drift(0.5);
  streams_.gnss.fixes.clear();
  streams_.barometer.samples.clear();
  Random random(4);
  for (size_t i = 0; i < flight_.size(); ++i)
    AddFix(records_[i].time, flight_[i].Inverse() * kAntenna, &random, 0.02);
  options_.gnss.correlation_s = 60;
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_EQ(report.used, kRows * kColumns);
  EXPECT_LT(Error(report.origin), 0.03);
}

TEST_F(GeoreferencingTest, CovariancesAreThoseOfTheErrors) {
  Drift(0.5);
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  const MapCovariances covariances = EstimateMapCovariances(made_.atlas, world_.world().pinhole, {},
                                                            {{MapId{0}, report}}, nullptr);
  double squared = 0, sigma = 0;
  for (size_t i = 0; i < flight_.size(); ++i) {
    FrameRecord record = records_[i];
    record.cam_from_world = map().At(visit_.keyframes[i]).cam_from_world;
    const auto covariance = PoseCovariance(record, made_.atlas, covariances);
    ASSERT_TRUE(covariance);
    const Eigen::Vector3d error =
        LocalFromLocal(kOrigin, report.origin) * record.cam_from_world.InverseTranslation() -
        flight_[i].InverseTranslation();
    squared += error.squaredNorm();
    sigma += covariance->topLeftCorner<3, 3>().trace();
  }
  // The errors of all have much in common: one flight tells little more than their size.
  EXPECT_GT(squared / sigma, 0.1);
  EXPECT_LT(squared / sigma, 4);
}

TEST_F(GeoreferencingTest, AFramesOwnPixelsAddToWhatItsKeyframeLeavesOpen) {
  const MapCovariances covariances =
      EstimateMapCovariances(made_.atlas, world_.world().pinhole, {}, {}, nullptr);
  const KeyframeId keyframe = visit_.keyframes[20];
  FrameRecord record = records_[20];
  const SE3 beside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0, 0));
  record.cam_from_world = beside * map().At(keyframe).cam_from_world;
  const auto at_keyframe = PoseCovariance(record, made_.atlas, covariances);
  ASSERT_TRUE(at_keyframe);
  record.id = FrameId{1000};                                       // Between keyframes.
  EXPECT_FALSE(PoseCovariance(record, made_.atlas, covariances));  // No pixel told its pose.
  record.pose_information = 1e4 * Matrix6d::Identity();
  record.pose.keyframe_scale = map().At(keyframe).scale / 2;  // In units of half the size.
  const auto between = PoseCovariance(record, made_.atlas, covariances);
  ASSERT_TRUE(between);
  const Matrix6d own = *between - *at_keyframe;
  EXPECT_NEAR(own(0, 0), 4e-4, 1e-9);
  EXPECT_NEAR(own(4, 4), 1e-4, 1e-9);
  record.inferred = true;
  EXPECT_FALSE(PoseCovariance(record, made_.atlas, covariances));
}

TEST_F(GeoreferencingTest, PosesBetweenKeyframesScaleWithTheMap) {
  const KeyframeId keyframe = visit_.keyframes[20];
  const SE3 beside(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0, 0));  // 1 m
  const AnchoredPose pose{keyframe, beside, map().At(keyframe).scale};
  Drift(0.5);
  ASSERT_TRUE(Apply().found);
  const SE3 found = map().PoseOf(pose) * map().At(keyframe).cam_from_world.Inverse();
  EXPECT_NEAR(found.translation().norm(), 1, 0.1);
}

TEST_F(GeoreferencingTest, OutliersAndAJumpOfTheBarometerDoNotMoveTheMap) {
  for (size_t i = 5; i < streams_.gnss.fixes.size(); i += 10)
    streams_.gnss.fixes[i].latitude_deg += 2e-4;  // 22 m
  for (size_t i = 25; i < streams_.barometer.samples.size(); ++i)
    streams_.barometer.samples[i].altitude_m += 5;
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_EQ(report.used, kRows * kColumns - 5);
  EXPECT_LT(Error(report.origin), 0.25);
}

/// The map in metres and level, but for these errors, as by an IMU.
class GeoreferencingOfMetresTest : public GeoreferencingTest {
 protected:
  GeoreferenceReport ApplyTo(double scale, double tilt_rad) {
    const Sim3 metric = Sim3(scale, RotationExp({tilt_rad, 0, 0}), {0, 0, 0}) *
                        Sim3(1, RotationExp({0, 0, 2}), {0, 0, 0}) * kMapFromLocal.Inverse();
    Mapper mapper(camera(), {}, &made_.atlas, nullptr);
    mapper.ChangeGauge(MapId{0}, metric, {GaugeKind::kMetric, {}, kPrior.scale_sigma});
    priors_[MapId{0}] = kPrior;
    return Apply();
  }
  double Scale() {
    const auto centre = [&](size_t i) {
      return map().At(visit_.keyframes[i]).cam_from_world.InverseTranslation();
    };
    const auto truth = [&](size_t i) { return flight_[i].InverseTranslation(); };
    return (centre(0) - centre(40)).norm() / (truth(0) - truth(40)).norm();
  }

  static constexpr MetricPrior kPrior{0.002, 0.005};
};

TEST_F(GeoreferencingOfMetresTest, ScaleAndLevelHoldAgainstFixesThatTellLess) {
  // As a receiver's errors do that change within minutes.
  for (size_t i = 0; i < streams_.gnss.fixes.size(); ++i)
    streams_.gnss.fixes[i].longitude_deg += 3e-7 * static_cast<double>(i % kColumns);
  options_.gnss.correlation_s = 60;
  const GeoreferenceReport report = ApplyTo(1, 0);
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_TRUE(report.held_by_imu);
  EXPECT_NEAR(Scale(), 1, 0.005);
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kGeoreferenced);
  EXPECT_LE(report.found->scale_sigma(), kPrior.scale_sigma);
}

TEST_F(GeoreferencingOfMetresTest, FixesAreBelievedWhereTheyContradict) {
  for (const auto& [scale, tilt_rad] : {std::pair(1.2, 0.), std::pair(1., 0.3)}) {
    const GeoreferenceReport report = ApplyTo(scale, tilt_rad);
    ASSERT_TRUE(report.found) << report.reason;
    EXPECT_FALSE(report.held_by_imu);
    EXPECT_LT(Error(report.origin), 0.25);
    made_.atlas.At(MapId{0}).Transform(kMapFromLocal);
  }
}

/// Photographs whose gimbal says how they were turned.
class GeoreferencingByAttitudesTest : public GeoreferencingTest {
 protected:
  /// But for a turn that is the same in all.
  void AddAttitudes(const Eigen::Vector3d& off_rad) {
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Eigen::Quaterniond enu_from_cam =
          RotationExp(off_rad) * flight_[i].rotation().conjugate();
      streams_.attitude.samples.push_back({records_[i].time, enu_from_cam});
    }
  }
};

TEST_F(GeoreferencingByAttitudesTest, AnglesPlaceAMapOfWhichOneLineAloneHasFixes) {
  streams_.gnss.fixes.resize(kColumns);
  streams_.barometer.samples.clear();
  options_.georeference.level_sigma_deg = 180;  // As a camera that looks across the line.
  const GeoreferenceReport without = Apply();
  EXPECT_FALSE(without.found);
  AddAttitudes({0.005, 0.005, 0.1});
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_TRUE(report.held_by_attitude);
  EXPECT_LT(Error(report.origin), 0.4);
}

TEST_F(GeoreferencingByAttitudesTest, FixesAreBelievedWhereTheAnglesContradict) {
  AddAttitudes({0.3, 0, 0});
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_FALSE(report.held_by_attitude);
  EXPECT_LT(Error(report.origin), 0.25);
}

TEST_F(GeoreferencingByAttitudesTest, FixesOfOneLineContradictAHeading) {
  streams_.gnss.fixes.resize(kColumns);
  streams_.barometer.samples.clear();
  options_.georeference.level_sigma_deg = 180;
  AddAttitudes({0, 0, 1});
  const GeoreferenceReport report = Apply();
  EXPECT_FALSE(report.found);
  EXPECT_FALSE(report.held_by_attitude);
}

TEST_F(GeoreferencingByAttitudesTest, AnglesThatAreNoneAreLeftOut) {
  for (size_t i = 0; i < flight_.size(); ++i) {
    const Eigen::Quaterniond spin = RotationExp({0, 0, static_cast<double>(i)});
    streams_.attitude.samples.push_back({records_[i].time, spin});
  }
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_FALSE(report.held_by_attitude);
  EXPECT_LT(Error(report.origin), 0.25);
}

TEST_F(GeoreferencingTest, FixesOfAnotherTimeLeaveTheMapAsItIs) {
  for (GnssFix& fix : streams_.gnss.fixes) fix.time.nanoseconds += int64_t{1000} * 1000000000;
  const SE3 before = map().At(visit_.keyframes[7]).cam_from_world;
  const GeoreferenceReport report = Apply();
  EXPECT_FALSE(report.found);
  EXPECT_NE(report.reason.find("0 of 48 fixes"), std::string::npos) << report.reason;
  EXPECT_EQ(made_.atlas.GaugeOf(MapId{0}).kind, GaugeKind::kFree);
  EXPECT_EQ(map().At(visit_.keyframes[7]).cam_from_world.translation(), before.translation());
}

}  // namespace
}  // namespace deepuav
