#include "deepuav/system/sensors/georeferencing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/finish/pose_covariances.h"
#include "deepuav/system/sensors/fix_trial.h"
#include "support/synthetic_visits.h"

namespace deepuav {
namespace {

const GeoPoint kOrigin{47.4, 8.5, 500};
const Eigen::Vector3d kAntenna(0.2, -0.1, 0);
/// What the camera makes of the flight: another place, another scale.
const Sim3 kMapFromLocal(0.1, RotationExp({0.4, 0.2, -1}), {2, 1, -3});
constexpr int kRows = 4, kColumns = 12;
constexpr double kHeight = 12, kSpacing = 3;

/// Rows flown to and fro over ground.
std::vector<SE3> Flight() {
  std::vector<SE3> poses;
  for (int row = 0; row < kRows; ++row) {
    for (int k = 0; k < kColumns; ++k) {
      const int column = row % 2 == 0 ? k : kColumns - 1 - k;
      poses.push_back(LookDown({kSpacing * column, kSpacing * row - 5, kHeight}, 0));
    }
  }
  return poses;
}

/// A map whose scale grows along the flight, records of its keyframes, and what sensors measured.
class GeoreferencingTest : public testing::Test {
 protected:
  GeoreferencingTest() : world_(StripOfGround(1, 1200)), made_(world_, 2), flight_(Flight()) {
    made_.AddMap();
    visit_ = made_.Add(MapId{0}, flight_, kMapFromLocal, {0.3, 0.3, 0, 0});
    Random random(3);
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Keyframe& keyframe = map().At(visit_.keyframes[i]);
      FrameRecord record;
      record.id = keyframe.frame.id;
      record.time = keyframe.frame.time;
      record.map = MapId{0};
      record.pose = {keyframe.id, SE3(), keyframe.scale};
      records_.push_back(record);
      AddFix(record.time, flight_[i].Inverse() * kAntenna, &random);
    }
    streams_.gnss.antenna_cam_m = kAntenna;
    options_.gnss.correlation_s = 0;
    options_.barometer.step_s = 0.05;  // The keyframes are so close in time.
    options_.barometer.window_s = 0.01;
  }

  Map& map() { return made_.atlas.At(MapId{0}); }

  void AddFix(Timestamp time, const Eigen::Vector3d& position_m, Random* random,
              double sigma_m = 0.3) {
    const Eigen::Vector3d noise(random->Gaussian(sigma_m), random->Gaussian(sigma_m),
                                random->Gaussian(sigma_m));
    const GeoPoint point = GeoFromLocal(kOrigin, position_m + noise);
    streams_.gnss.fixes.push_back({time, point.latitude_deg, point.longitude_deg, point.altitude_m,
                                   Eigen::Vector3d::Constant(sigma_m)});
    streams_.barometer.samples.push_back({time, 0, 20 + (position_m).z()});
  }

  /// The map bends: later parts are larger, as a camera alone may see it.
  void Drift(double growth) {
    const double count = static_cast<double>(flight_.size());
    const auto grown = [&](const Eigen::Vector3d& position) {
      const Eigen::Vector3d local = kMapFromLocal.Inverse() * position;
      const double factor = 1 + growth * (local.y() + 5) / count;
      return kMapFromLocal * Eigen::Vector3d(factor * local);
    };
    for (const KeyframeId id : visit_.keyframes) {
      const SE3 pose = map().At(id).cam_from_world;
      map().SetPose(id,
                    SE3(pose.rotation(), -(pose.rotation() * grown(pose.InverseTranslation()))));
    }
    std::vector<LandmarkId> landmarks;
    map().landmarks().ForEach([&](const Landmark& l) { landmarks.push_back(l.id); });
    for (LandmarkId id : landmarks) map().SetPosition(id, grown(map().At(id).position_world));
  }

  GeoreferenceReport Apply() {
    Mapper mapper(camera(), {}, &made_.atlas, nullptr);
    Georeferencing georeferencing(streams_, options_, priors_, &mapper, &made_.atlas);
    Pinhole pinhole = world_.world().pinhole;
    return georeferencing.Apply(MapId{0}, records_, &pinhole, false, nullptr);
  }

  Camera camera() {
    Camera camera;
    camera.pinhole = world_.world().pinhole;
    camera.width = 752;
    camera.height = 480;
    return camera;
  }

  /// Root mean squared distance of the keyframes from the truth, about the truth's origin.
  double Error(const GeoPoint& origin) {
    double squares = 0;
    for (size_t i = 0; i < flight_.size(); ++i) {
      const Eigen::Vector3d found =
          LocalFromLocal(kOrigin, origin) *
          map().At(visit_.keyframes[i]).cam_from_world.InverseTranslation();
      squares += (found - flight_[i].InverseTranslation()).squaredNorm();
    }
    return std::sqrt(squares / static_cast<double>(flight_.size()));
  }

  const FeatureWorld world_;
  SyntheticVisits made_;
  std::vector<SE3> flight_;
  Visit visit_;
  std::vector<FrameRecord> records_;
  SensorStreams streams_;
  SensorUseOptions options_;
  MetricPriors priors_;
};

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

/// Fixes to a centimetre, and a photograph that a corner of it alone holds, a bit off.
class GeoreferencingByCarrierTest : public GeoreferencingTest {
 protected:
  static constexpr size_t kWeak = 20;

  GeoreferencingByCarrierTest() {
    streams_.gnss.fixes.clear();
    streams_.barometer.samples.clear();
    Random random(4);
    for (size_t i = 0; i < flight_.size(); ++i)
      AddFix(records_[i].time, flight_[i].Inverse() * kAntenna, &random, 0.01);
  }

  /// What it sees in the corner is measured as from that far beside.
  void HoldByACorner(const Eigen::Vector3d& off_m) {
    constexpr double kCornerPx = 170;
    const KeyframeId id = visit_.keyframes[kWeak];
    const Eigen::Vector3d corner_ray =
        camera().pinhole.Unproject({kCornerPx / 2, kCornerPx / 2}).normalized();
    const Eigen::Vector3d seen = flight_[kWeak].Inverse() * (kHeight / corner_ray.z() * corner_ray);
    const Eigen::Vector3d centre = flight_[kWeak].InverseTranslation();
    const auto turn = Eigen::Quaterniond::FromTwoVectors(seen - centre - off_m, seen - centre);
    const Eigen::Quaterniond rotation = flight_[kWeak].rotation() * turn;
    const SE3 beside(rotation, -(rotation * (centre + off_m)));
    const std::vector<LandmarkId> landmarks = map().At(id).landmarks;
    for (const LandmarkId landmark : landmarks) {
      if (!landmark.valid()) continue;
      const Eigen::Vector3d local = kMapFromLocal.Inverse() * map().At(landmark).position_world;
      const Eigen::Vector2d px = camera().pinhole.Project(beside * local);
      if (px.maxCoeff() > kCornerPx) {
        map().RemoveObservation(id, landmark);
      } else {
        map().SetMeasurement(id, landmark, {px.cast<float>(), 1.0, false});
      }
    }
    map().SetPose(id, kMapFromLocal.MovePose(beside));
  }

  double ErrorOf(size_t i, const GeoPoint& origin) {
    return (LocalFromLocal(kOrigin, origin) *
                map().At(visit_.keyframes[i]).cam_from_world.InverseTranslation() -
            flight_[i].InverseTranslation())
        .norm();
  }
};

TEST_F(GeoreferencingByCarrierTest, AFixWinsOverAPhotographThatIsHeldByACorner) {
  HoldByACorner({0.3, -0.2, 0.1});
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_EQ(report.used, kRows * kColumns);
  EXPECT_LT(ErrorOf(kWeak, report.origin), 0.05);
}

TEST_F(GeoreferencingByCarrierTest, ACornerLetsAPhotographBeElsewhereAndAllOfItDoesNot) {
  const double unit = kMapFromLocal.scale();  // 1 m in the map
  PositionFactor fix;
  fix.position_world = kMapFromLocal * flight_[kWeak].InverseTranslation();
  fix.per_sigma.setConstant(1 / (0.01 * unit));
  const KeyframeId id = visit_.keyframes[kWeak];
  const FixTrial there = TryFix(map(), id, fix, camera().pinhole);
  EXPECT_GT(there.agreeing, 0.98 * there.agreeing_now);
  EXPECT_LT(there.fix_sigmas, 3);
  fix.position_world.x() += 0.3 * unit;
  const FixTrial beside = TryFix(map(), id, fix, camera().pinhole);
  EXPECT_GT(beside.agreeing_now, 100);
  EXPECT_GT(beside.fix_sigmas, 10);
  HoldByACorner({0, 0, 0});
  const FixTrial of_corner = TryFix(map(), id, fix, camera().pinhole);
  EXPECT_GT(of_corner.agreeing, 0.8 * of_corner.agreeing_now);
  EXPECT_LT(of_corner.fix_sigmas, 4);
}

TEST_F(GeoreferencingByCarrierTest, AFixThatIsWrongDoesNotWinOverAPhotographThatSeesMuch) {
  streams_.gnss.fixes[kWeak].latitude_deg += 3e-6;  // 0.3 m
  const GeoreferenceReport report = Apply();
  ASSERT_TRUE(report.found) << report.reason;
  EXPECT_EQ(report.used, kRows * kColumns - 1);
  EXPECT_LT(ErrorOf(kWeak, report.origin), 0.05);
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
