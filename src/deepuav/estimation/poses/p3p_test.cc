#include "deepuav/estimation/poses/p3p.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using Points = std::array<Eigen::Vector3d, 3>;

SE3 RandomPose(Random* random) {
  Vector6d twist;
  for (int i = 0; i < 6; ++i) twist[i] = random->Uniform(-2, 2);
  return SE3::Exp(twist);
}

/// Points in front of the camera, at distances between `nearest` and `farthest`.
Points RandomPointsCam(Random* random, double nearest, double farthest, double half_width) {
  Points points;
  for (Eigen::Vector3d& point : points) {
    const Eigen::Vector3d ray(random->Uniform(-half_width, half_width),
                              random->Uniform(-half_width, half_width), 1);
    point = ray.normalized() * random->Uniform(nearest, farthest);
  }
  return points;
}

P3PSolutions SolveFor(const Points& points_cam, const SE3& cam_from_world, Points* points_world) {
  Points rays;
  for (size_t i = 0; i < 3; ++i) {
    (*points_world)[i] = cam_from_world.Inverse() * points_cam[i];
    rays[i] = points_cam[i].normalized();
  }
  return SolveP3P(*points_world, rays);
}

double Difference(const SE3& a, const SE3& b) {
  return (a.Matrix() - b.Matrix()).cwiseAbs().maxCoeff();
}

double NearestTo(const SE3& truth, const P3PSolutions& solutions) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < solutions.count; ++i)
    nearest =
        std::min(nearest, Difference(solutions.cams_from_world[static_cast<size_t>(i)], truth));
  return nearest;
}

TEST(SolveP3P, TheTruthIsAmongTheSolutions) {
  Random random(1);
  std::vector<double> errors;
  for (int i = 0; i < 20000; ++i) {
    const SE3 truth = RandomPose(&random);
    Points world;
    const Points cam = RandomPointsCam(&random, 2, 12, 0.8);
    errors.push_back(NearestTo(truth, SolveFor(cam, truth, &world)));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 1e-11);
  EXPECT_LT(errors[errors.size() * 999 / 1000], 1e-4);
}

TEST(SolveP3P, EachSolutionSeesThePointsAlongTheRays) {
  Random random(2);
  int solutions_seen = 0;
  for (int i = 0; i < 5000; ++i) {
    const Points cam = RandomPointsCam(&random, 2, 12, 0.8);
    Points world;
    const P3PSolutions solutions = SolveFor(cam, RandomPose(&random), &world);
    ASSERT_LE(solutions.count, 4);
    for (int s = 0; s < solutions.count; ++s) {
      const SE3& pose = solutions.cams_from_world[static_cast<size_t>(s)];
      EXPECT_NEAR(pose.RotationMatrix().determinant(), 1, 1e-12);
      for (size_t k = 0; k < 3; ++k)
        EXPECT_GT((pose * world[k]).normalized().dot(cam[k].normalized()), 1 - 1e-9);
      ++solutions_seen;
    }
  }
  EXPECT_GT(solutions_seen, 5000);
}

TEST(SolveP3P, OfAPlaneSeenFromHighAbove) {
  Random random(3);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    Points cam;
    for (Eigen::Vector3d& point : cam)
      point = {random.Uniform(-60, 60), random.Uniform(-40, 40), 100};
    const SE3 truth = RandomPose(&random);
    Points world;
    found += NearestTo(truth, SolveFor(cam, truth, &world)) < 1e-3;
  }
  EXPECT_GT(found, 1980);
}

TEST(SolveP3P, ScaleOfTheWorldDoesNotMatter) {
  Random random(4);
  for (double scale : {1e-4, 1e4}) {
    int found = 0;
    for (int i = 0; i < 1000; ++i) {
      Points cam = RandomPointsCam(&random, 2, 12, 0.8);
      for (Eigen::Vector3d& point : cam) point *= scale;
      const SE3 unit = RandomPose(&random);
      const SE3 truth(unit.rotation(), unit.translation() * scale);
      Points world;
      const P3PSolutions solutions = SolveFor(cam, truth, &world);
      double nearest = std::numeric_limits<double>::infinity();
      for (int s = 0; s < solutions.count; ++s) {
        const SE3& pose = solutions.cams_from_world[static_cast<size_t>(s)];
        nearest = std::min(nearest, (pose.translation() - truth.translation()).norm() / scale);
      }
      found += nearest < 1e-5;
    }
    EXPECT_GT(found, 990) << scale;
  }
}

TEST(SolveP3P, NothingOfDegenerateInput) {
  const Points rays = {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.1, 0, 1).normalized(),
                       Eigen::Vector3d(0, 0.1, 1).normalized()};
  const Eigen::Vector3d p(1, 2, 3), step(0.5, 0.1, -0.2);
  EXPECT_EQ(SolveP3P({p, p, p}, rays).count, 0);
  EXPECT_EQ(SolveP3P({p, p, p + step}, rays).count, 0);
  EXPECT_EQ(SolveP3P({p, p + step, p + 3 * step}, rays).count, 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(SolveP3P({p, p + step, Eigen::Vector3d(nan, 0, 0)}, rays).count, 0);
}

}  // namespace
}  // namespace deepuav
