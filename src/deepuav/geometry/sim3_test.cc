#include "deepuav/geometry/sim3.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

Eigen::Vector3d RandomVector(Random* random) {
  return {random->Gaussian(1), random->Gaussian(1), random->Gaussian(1)};
}

SE3 RandomPose(Random* random) {
  return SE3(RotationExp(RandomVector(random)), 3 * RandomVector(random));
}

Sim3 RandomSim3(Random* random) { return Sim3(RandomPose(random), random->Uniform(0.2, 5)); }

void ExpectNear(const Sim3& a, const Sim3& b) {
  EXPECT_NEAR(a.scale(), b.scale(), 1e-12 * b.scale());
  EXPECT_LT(a.rotation().angularDistance(b.rotation()), 1e-7);
  EXPECT_LT((a.translation() - b.translation()).norm(), 1e-11);
}

TEST(Sim3, ScalesThenTurnsThenShifts) {
  const Sim3 transform(2, RotationExp({0, 0, M_PI / 2}), {10, 0, 0});
  EXPECT_LT((transform * Eigen::Vector3d(1, 2, 3) - Eigen::Vector3d(6, 2, 6)).norm(), 1e-12);
}

TEST(Sim3, IsAGroup) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Sim3 a = RandomSim3(&random), b = RandomSim3(&random), c = RandomSim3(&random);
    ExpectNear(a * a.Inverse(), Sim3());
    ExpectNear(a.Inverse() * a, Sim3());
    ExpectNear((a * b) * c, a * (b * c));
    ExpectNear((a * b).Inverse(), b.Inverse() * a.Inverse());
    ExpectNear(a * Sim3(), a);
  }
}

TEST(Sim3, ProductMovesPointsAsItsFactorsDo) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Sim3 a = RandomSim3(&random), b = RandomSim3(&random);
    const Eigen::Vector3d point = RandomVector(&random);
    EXPECT_LT(((a * b) * point - a * (b * point)).norm(), 1e-11);
    EXPECT_LT((a.Inverse() * (a * point) - point).norm(), 1e-11);
  }
}

TEST(Sim3, OfScaleOneIsRigid) {
  Random random(3);
  const SE3 a = RandomPose(&random), b = RandomPose(&random);
  ExpectNear(Sim3(a) * Sim3(b), Sim3(a * b));
  ExpectNear(Sim3(a).Inverse(), Sim3(a.Inverse()));
}

// A camera that moved with its world sees the moved points in the same directions, at scaled
// depths.
TEST(Sim3, MovePoseKeepsWhatTheCameraSees) {
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    const Sim3 new_from_old = RandomSim3(&random);
    const SE3 cam_from_old = RandomPose(&random);
    const SE3 cam_from_new = new_from_old.MovePose(cam_from_old);
    const Eigen::Vector3d point = RandomVector(&random);
    EXPECT_LT(
        (cam_from_new * (new_from_old * point) - new_from_old.scale() * (cam_from_old * point))
            .norm(),
        1e-11);
    EXPECT_LT((cam_from_new.InverseTranslation() - new_from_old * cam_from_old.InverseTranslation())
                  .norm(),
              1e-11);
  }
}

TEST(Sim3, MovePoseFollowsProducts) {
  Random random(5);
  const Sim3 a = RandomSim3(&random), b = RandomSim3(&random);
  const SE3 pose = RandomPose(&random);
  ExpectNear(Sim3(a.MovePose(b.MovePose(pose))), Sim3((a * b).MovePose(pose)));
  ExpectNear(Sim3(a.Inverse().MovePose(a.MovePose(pose))), Sim3(pose));
}

}  // namespace
}  // namespace deepuav
