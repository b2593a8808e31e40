#include <gtest/gtest.h>

#include <vector>

#include "deepuav/sensors/geodesy.h"
#include "deepuav/system/sensors/fix_trial.h"
#include "deepuav/system/testing/georeferencing_fixture.h"

namespace deepuav {
namespace {

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

}  // namespace
}  // namespace deepuav
