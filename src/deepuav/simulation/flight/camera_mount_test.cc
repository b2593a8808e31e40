#include "deepuav/simulation/flight/camera_mount.h"

#include <gtest/gtest.h>

namespace deepuav {
namespace {

const Eigen::Vector3d kAhead(1, 0, 0), kLeft(0, 1, 0), kUp(0, 0, 1);

SE3 Mounted(double pitch_deg, double pan_deg) {
  CameraMountOptions mount;
  mount.pitch_deg = pitch_deg;
  mount.pan_deg = pan_deg;
  return BodyFromCam(mount);
}

void ExpectAxes(const SE3& body_from_cam, const Eigen::Vector3d& right,
                const Eigen::Vector3d& forward) {
  EXPECT_LT((body_from_cam.RotationMatrix().col(0) - right).norm(), 1e-9);
  EXPECT_LT((body_from_cam.RotationMatrix().col(2) - forward).norm(), 1e-9);
}

TEST(CameraMount, LooksWherePitchAndPanSay) {
  ExpectAxes(Mounted(0, 0), -kLeft, kAhead);
  ExpectAxes(Mounted(-90, 0), -kLeft, -kUp);
  ExpectAxes(Mounted(0, 90), kAhead, kLeft);
  ExpectAxes(Mounted(-45, 0), -kLeft, (kAhead - kUp).normalized());
}

TEST(CameraMount, NadirHasAheadAtTheTop) {
  EXPECT_LT((Mounted(-90, 0).rotation() * Eigen::Vector3d(0, -1, 0) - kAhead).norm(), 1e-9);
}

TEST(CameraMount, SitsWhereItIsPut) {
  EXPECT_EQ(Mounted(-30, 10).translation(), Eigen::Vector3d(0.1, 0, -0.03));
}

}  // namespace
}  // namespace deepuav
