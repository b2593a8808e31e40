#include "deepuav/geometry/alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d RandomVector(Random* random, double sigma) {
  return {random->Gaussian(sigma), random->Gaussian(sigma), random->Gaussian(sigma)};
}

// A cloud with the given standard deviations along the axes.
Points Cloud(const Eigen::Vector3d& sigmas, int count, Random* random) {
  Points points;
  for (int i = 0; i < count; ++i) {
    points.push_back(RandomVector(random, 1).cwiseProduct(sigmas) + Eigen::Vector3d(3, -5, 2));
  }
  return points;
}

Points Transform(const Sim3& transform, const Points& points, double noise = 0,
                 Random* random = nullptr) {
  Points moved;
  for (const Eigen::Vector3d& point : points) {
    moved.push_back(transform * point);
    if (noise > 0) moved.back() += RandomVector(random, noise);
  }
  return moved;
}

Sim3 RandomSim3(double scale, Random* random) {
  return Sim3(scale, RotationExp(RandomVector(random, 1.5)), RandomVector(random, 10));
}

double SquaredError(const Sim3& transform, const Points& source, const Points& target) {
  double sum = 0;
  for (size_t i = 0; i < source.size(); ++i) {
    sum += (target[i] - transform * source[i]).squaredNorm();
  }
  return sum;
}

void ExpectNear(const Sim3& found, const Sim3& expected, double rotation_rad, double translation,
                double scale) {
  EXPECT_LT(found.rotation().angularDistance(expected.rotation()), rotation_rad);
  EXPECT_LT((found.translation() - expected.translation()).norm(), translation);
  EXPECT_NEAR(found.scale(), expected.scale(), scale);
}

TEST(Align, FindsExactTransforms) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Points source = Cloud({2, 1, 3}, 3 + i, &random);
    const Sim3 similar = RandomSim3(random.Uniform(0.1, 10), &random);
    ExpectNear(*Align(source, Transform(similar, source), AlignmentKind::kSimilar), similar, 1e-7,
               1e-7, 1e-8);
    const Sim3 rigid = RandomSim3(1, &random);
    ExpectNear(*Align(source, Transform(rigid, source), AlignmentKind::kRigid), rigid, 1e-7, 1e-7,
               1e-12);
    const Sim3 yaw(1, RotationExp({0, 0, random.Uniform(-3, 3)}), RandomVector(&random, 10));
    ExpectNear(*Align(source, Transform(yaw, source), AlignmentKind::kYaw), yaw, 1e-7, 1e-7, 1e-12);
  }
}

TEST(Align, AveragesNoise) {
  Random random(2);
  const Points source = Cloud({2, 2, 2}, 10000, &random);
  const Sim3 truth = RandomSim3(2.5, &random);
  const Points target = Transform(truth, source, 0.05, &random);
  ExpectNear(*Align(source, target, AlignmentKind::kSimilar), truth, 1e-3, 5e-3, 1e-3);
}

// Least squares: no small change of the result lowers the error.
TEST(Align, IsAMinimum) {
  Random random(3);
  const Points source = Cloud({2, 1, 3}, 20, &random);
  const Points target = Transform(RandomSim3(1.2, &random), source, 0.5, &random);
  for (const AlignmentKind kind :
       {AlignmentKind::kRigid, AlignmentKind::kSimilar, AlignmentKind::kYaw}) {
    const Sim3 best = Align(source, target, kind).value();
    const double error = SquaredError(best, source, target);
    for (int i = 0; i < 200; ++i) {
      Eigen::Vector3d turn = RandomVector(&random, 1e-3);
      if (kind == AlignmentKind::kYaw) turn.head<2>().setZero();
      const double scale =
          kind == AlignmentKind::kSimilar ? best.scale() + random.Gaussian(1e-3) : 1;
      const Sim3 changed(scale, RotationExp(turn) * best.rotation(),
                         best.translation() + RandomVector(&random, 1e-3));
      EXPECT_GE(SquaredError(changed, source, target), error);
    }
  }
}

TEST(Align, RotatesWhereAReflectionWouldFitBetter) {
  Random random(4);
  const Points source = Cloud({3, 2, 1}, 100, &random);
  Points mirrored = source;
  for (Eigen::Vector3d& point : mirrored) point.z() = -point.z();
  for (const AlignmentKind kind : {AlignmentKind::kRigid, AlignmentKind::kSimilar}) {
    const auto found = Align(source, mirrored, kind);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->rotation().toRotationMatrix().determinant(), 1, 1e-12);
    EXPECT_GT(found->scale(), 0);
    EXPECT_LT(SquaredError(*found, source, mirrored),
              SquaredError(Sim3(), source, mirrored) + 1e-9);
  }
}

TEST(Align, AcceptsPlanarPoints) {
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const Points source = Cloud({3, 2, 0}, 4 + i, &random);
    const Sim3 truth = RandomSim3(0.7, &random);
    ExpectNear(*Align(source, Transform(truth, source), AlignmentKind::kSimilar), truth, 1e-7, 1e-7,
               1e-8);
  }
}

TEST(Align, RefusesCollinearPoints) {
  Random random(6);
  const Eigen::Vector3d direction = RandomVector(&random, 1);
  Points line, cloud = Cloud({1, 1, 1}, 30, &random);
  for (int i = 0; i < 30; ++i)
    line.push_back(Eigen::Vector3d(500, -300, 20) + 0.37 * i * direction);
  const Sim3 truth = RandomSim3(2, &random);
  for (const AlignmentKind kind : {AlignmentKind::kRigid, AlignmentKind::kSimilar}) {
    EXPECT_FALSE(Align(line, Transform(truth, line), kind));
    EXPECT_FALSE(Align(line, cloud, kind));
    EXPECT_FALSE(Align(cloud, line, kind));
    EXPECT_FALSE(Align(line, Transform(truth, line, 0.1, &random), kind));
  }
}

TEST(Align, YawNeedsHorizontalExtent) {
  Points vertical, slanted;
  for (int i = 0; i < 10; ++i) {
    vertical.emplace_back(400, 7, 0.3 * i);
    slanted.emplace_back(0.1 * i, 0, 0.3 * i);
  }
  EXPECT_FALSE(Align(vertical, vertical, AlignmentKind::kYaw));
  EXPECT_FALSE(Align(slanted, vertical, AlignmentKind::kYaw));
  const Sim3 truth(1, RotationExp({0, 0, 2}), {1, 2, 3});
  ExpectNear(*Align(slanted, Transform(truth, slanted), AlignmentKind::kYaw), truth, 1e-9, 1e-9,
             1e-12);
}

TEST(Align, RefusesDegenerateAndBadInput) {
  Random random(7);
  const Points three = Cloud({1, 1, 1}, 3, &random);
  const Points two(three.begin(), three.begin() + 2), same(5, Eigen::Vector3d(1, 2, 3));
  Points not_finite = three;
  not_finite[1].x() = std::numeric_limits<double>::quiet_NaN();
  for (const AlignmentKind kind :
       {AlignmentKind::kRigid, AlignmentKind::kSimilar, AlignmentKind::kYaw}) {
    EXPECT_TRUE(Align(three, three, kind));
    EXPECT_FALSE(Align(two, two, kind));
    EXPECT_FALSE(Align({}, {}, kind));
    EXPECT_FALSE(Align(same, same, kind));
    EXPECT_FALSE(Align(three, not_finite, kind));
    EXPECT_THROW(Align(three, two, kind), Error);
  }
}

}  // namespace
}  // namespace deepuav
