#include "deepuav/system/sensors/known_worlds.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

const MapId kOld{0}, kYoung{1};

MetricFromMap Place() {
  MetricFromMap place;
  place.metric_from_map = Sim3(3, RotationExp({0.1, 0.2, 0.3}), {100, -50, 20});
  place.origin = GeoPoint{47, 8, 400};
  Eigen::Matrix<double, 7, 1> sigmas;
  sigmas << 0.01, 0.02, 0.03, 0.5, 0.6, 0.7, 0.04;
  place.covariance = sigmas.cwiseAbs2().asDiagonal();
  return place;
}

/// Of where a point of the map lies.
Eigen::Matrix3d CovarianceOf(const MetricFromMap& metric, const Eigen::Vector3d& in_map) {
  const Eigen::Vector3d arm =
      metric.metric_from_map * in_map - metric.metric_from_map.translation();
  Eigen::Matrix<double, 3, 7> jacobian;
  jacobian << -Skew(arm), Eigen::Matrix3d::Identity(), arm;
  return jacobian * *metric.covariance * jacobian.transpose();
}

TEST(KnownWorlds, HoldFromARevisionOn) {
  KnownWorlds worlds;
  EXPECT_FALSE(worlds.In(kOld, 5));
  worlds.Use(kOld, 3, MetricFromMap{});
  worlds.Use(kOld, 6, Place());
  EXPECT_FALSE(worlds.In(kOld, 2));
  EXPECT_FALSE(worlds.In(kOld, 5)->origin);
  EXPECT_TRUE(worlds.In(kOld, 9)->origin);
  EXPECT_FALSE(worlds.In(kYoung, 9));
  worlds.Use(kOld, 10, std::nullopt);
  EXPECT_FALSE(worlds.In(kOld, 10));
}

TEST(KnownWorlds, APlaceIsWorthMoreThanMetres) {
  KnownWorlds worlds;
  worlds.Use(kYoung, 1, Place());
  worlds.Use(kYoung, 2, MetricFromMap{});
  worlds.OnGauge(kYoung, 3, {GaugeKind::kMetric, {}, 0.01});
  EXPECT_TRUE(worlds.In(kYoung, 3)->origin);
  worlds.Use(kOld, 1, MetricFromMap{});
  worlds.OnMap({MapChange::kMerged, kYoung, kOld, Sim3(), 4});
  EXPECT_FALSE(worlds.In(kOld, 3)->origin);
  EXPECT_TRUE(worlds.In(kOld, 4)->origin);
}

TEST(KnownWorlds, AMergerMovesNothingOnEarth) {
  const Sim3 old_from_young(0.5, RotationExp({0.4, 0.5, 0.6}), {7, 8, 9});
  const Eigen::Vector3d point(3, -4, 5);
  KnownWorlds worlds;
  worlds.Use(kYoung, 1, Place());
  worlds.OnMap({MapChange::kLoopClosed, kYoung, kYoung, Sim3(), 2});
  EXPECT_FALSE(worlds.In(kOld, 2));
  worlds.OnMap({MapChange::kMerged, kYoung, kOld, old_from_young, 4});
  const MetricFromMap young = *worlds.In(kYoung, 1), old = *worlds.In(kOld, 4);
  const Eigen::Vector3d in_old = old_from_young * point;
  EXPECT_LT((old.metric_from_map * in_old - young.metric_from_map * point).norm(), 1e-9);
  EXPECT_LT((CovarianceOf(old, in_old) - CovarianceOf(young, point)).norm(), 1e-9);
}

}  // namespace
}  // namespace deepuav
