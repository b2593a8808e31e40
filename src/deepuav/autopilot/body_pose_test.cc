#include "deepuav/autopilot/body_pose.h"

#include <gtest/gtest.h>

#include "deepuav/autopilot/mount.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using Eigen::Vector3d;

/// A camera in metres with z up that looks along `ahead`, level.
SE3 CamFromWorld(const Vector3d& position, const Vector3d& ahead) {
  const Vector3d down(0, 0, -1), right = down.cross(ahead);
  Eigen::Matrix3d world_from_cam;
  world_from_cam << right, down, ahead;
  return SE3(world_from_cam, position).Inverse();
}

SE3 Mount(const char* text, const Vector3d& offset = Vector3d::Zero()) {
  return {ParseMount(text), offset};
}

TEST(BodyPose, OfAMetricMapHasItsXInFront) {
  const MetricFromMap metric;
  const BodyPose pose =
      BodyPoseOf(CamFromWorld({1, 2, 3}, {1, 0, 0}), Matrix6d::Zero(), metric, Mount("forward"));
  EXPECT_TRUE(pose.local_from_body.translation().isApprox(Vector3d(1, -2, -3)));
  EXPECT_LT(pose.local_from_body.Angle(), 1e-9);
  EXPECT_FALSE(pose.covariance_is_known);
}

TEST(BodyPose, OfAGeoreferencedMapHasNorthInFront) {
  MetricFromMap metric;
  metric.origin = GeoPoint{47, 8, 400};
  const BodyPose north =
      BodyPoseOf(CamFromWorld({1, 2, 3}, {0, 1, 0}), Matrix6d::Zero(), metric, Mount("forward"));
  EXPECT_TRUE(north.local_from_body.translation().isApprox(Vector3d(2, 1, -3)));
  EXPECT_LT(north.local_from_body.Angle(), 1e-9);
  const BodyPose east =
      BodyPoseOf(CamFromWorld({0, 0, 0}, {1, 0, 0}), Matrix6d::Zero(), metric, Mount("forward"));
  EXPECT_TRUE(RotationLog(east.local_from_body.rotation()).isApprox(Vector3d(0, 0, M_PI / 2)));
}

TEST(BodyPose, TakesScaleLevelAndLeverArm) {
  MetricFromMap metric;
  metric.metric_from_map = Sim3(2, RotationExp({0.3, -0.2, 0.5}), {5, 6, 7});
  const SE3 body_from_cam = Mount("down", {0.5, 0, 0.1});
  const SE3 world_from_cam = CamFromWorld({1, 2, 3}, {0, 1, 0}).Inverse();
  const Sim3 map_from_metric = metric.metric_from_map.Inverse();
  // The same camera in the map's world.
  const SE3 map_from_cam(map_from_metric.rotation() * world_from_cam.rotation(),
                         map_from_metric * world_from_cam.translation());
  const SE3 found =
      BodyPoseOf(map_from_cam.Inverse(), Matrix6d::Zero(), metric, body_from_cam).local_from_body;
  const SE3 expected =
      BodyPoseOf(world_from_cam.Inverse(), Matrix6d::Zero(), {}, body_from_cam).local_from_body;
  EXPECT_TRUE(found.Matrix().isApprox(expected.Matrix(), 1e-12));
}

/// What many poses that err as the information says spread by.
TEST(BodyPose, CovarianceIsThatOfErrorsOfTheCamera) {
  Random random(3);
  MetricFromMap metric;
  metric.metric_from_map = Sim3(3, RotationExp({0.1, 0.2, 0.3}), {1, 2, 3});
  const SE3 body_from_cam = Mount("0,-30,10", {0.4, -0.2, 0.1});
  const SE3 cam_from_map(RotationExp({0.5, -0.4, 0.3}), {1, -1, 2});
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 1e-3 * random.Gaussian(1);
  root.diagonal().array() += 3e-3;
  const Matrix6d information = (root * root.transpose()).inverse();
  const BodyPose pose = BodyPoseOf(cam_from_map, information, metric, body_from_cam);
  ASSERT_TRUE(pose.covariance_is_known);
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kSamples = 20'000;
  for (int i = 0; i < kSamples; ++i) {
    Vector6d normal;
    for (double& value : normal) value = random.Gaussian(1);
    const SE3 erring =
        BodyPoseOf(SE3::Exp(root * normal) * cam_from_map, information, metric, body_from_cam)
            .local_from_body;
    Vector6d error;
    error << erring.translation() - pose.local_from_body.translation(),
        RotationLog(pose.local_from_body.rotation().conjugate() * erring.rotation());
    sampled += error * error.transpose() / kSamples;
  }
  EXPECT_LT((sampled - pose.covariance).norm(), 0.05 * pose.covariance.norm());
}

/// What the same pose spreads by in places of the map that err as the covariance says.
TEST(BodyPose, CovarianceOfTheMapsPlaceIsThatOfItsErrors) {
  Random random(4);
  MetricFromMap metric;
  metric.metric_from_map = Sim3(3, RotationExp({0.1, 0.2, 0.3}), {100, -50, 20});
  metric.origin = GeoPoint{47, 8, 400};
  Eigen::Matrix<double, 7, 7> root;
  for (int i = 0; i < 49; ++i) root(i / 7, i % 7) = 1e-3 * random.Gaussian(1);
  root.diagonal() << 4e-3, 3e-3, 8e-3, 0.02, 0.03, 0.05, 6e-3;
  metric.covariance = root * root.transpose();
  const SE3 body_from_cam = Mount("0,-30,10", {0.4, -0.2, 0.1});
  const SE3 cam_from_map(RotationExp({0.5, -0.4, 0.3}), {5, -7, 2});
  const auto pose_in = [&](const MetricFromMap& in) {
    return BodyPoseOf(cam_from_map, Matrix6d::Zero(), in, body_from_cam).local_from_body;
  };
  const SE3 pose = pose_in(metric);
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kSamples = 20'000;
  for (int i = 0; i < kSamples; ++i) {
    Eigen::Matrix<double, 7, 1> error;
    for (double& value : error) value = random.Gaussian(1);
    error = root * error;
    MetricFromMap erring = metric;
    const Sim3& place = metric.metric_from_map;
    erring.metric_from_map =
        Sim3(place.scale() * std::exp(error[6]), RotationExp(error.head<3>()) * place.rotation(),
             place.translation() + error.segment<3>(3));
    const SE3 found = pose_in(erring);
    Vector6d off;
    off << found.translation() - pose.translation(),
        RotationLog(pose.rotation().conjugate() * found.rotation());
    sampled += off * off.transpose() / kSamples;
  }
  const Matrix6d covariance = CovarianceOfMetric(metric, pose);
  EXPECT_LT((sampled - covariance).norm(), 0.05 * covariance.norm());
}

TEST(BodyPose, AScaleAloneIsUncertainAboutTheOrigin) {
  MetricFromMap metric;
  metric.scale_sigma = 0.1;
  const Matrix6d covariance = CovarianceOfMetric(metric, SE3(RotationExp({1, 2, 3}), {3, 0, -4}));
  EXPECT_NEAR(covariance(0, 0), 0.09, 1e-12);
  EXPECT_NEAR(covariance(0, 2), -0.12, 1e-12);
  EXPECT_EQ(covariance.bottomRows<3>().norm(), 0);
}

}  // namespace
}  // namespace deepuav
