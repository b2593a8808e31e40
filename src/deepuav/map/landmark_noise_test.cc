#include "deepuav/map/landmark_noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/map_builder.h"

namespace deepuav {
namespace {

constexpr double kFocal = 450, kSigmaPx = 0.4;
const Eigen::Vector3d kLandmark(1, 0.5, 20);

SE3 At(const Eigen::Vector3d& centre) { return SE3(Eigen::Quaterniond::Identity(), -centre); }

Eigen::Vector2d Project(const SE3& cam_from_world, const Eigen::Vector3d& point) {
  return kFocal * (cam_from_world * point).hnormalized();
}

/// A landmark seen from these places with an error of kSigmaPx.
struct SeenFrom {
  explicit SeenFrom(const std::vector<Eigen::Vector3d>& centres) {
    std::vector<KeyframeId> keyframes;
    for (const auto& centre : centres) keyframes.push_back(builder.AddKeyframe(At(centre)));
    landmark = builder.AddLandmark(keyframes, 0, kLandmark);
    for (KeyframeId keyframe : keyframes)
      builder.map.SetMeasurement(keyframe, landmark, {{}, kSigmaPx});
  }
  PixelNoise In(const Eigen::Vector3d& centre) const {
    const Eigen::Matrix3d noise = PositionNoise(builder.map, builder.map.At(landmark));
    return ExpectedPixelNoise(noise, kLandmark, At(centre));
  }

  MapBuilder builder{1, 3};
  LandmarkId landmark;
};

TEST(LandmarkNoise, IsThatOfPositionsFromNoisyPixels) {
  const std::vector<Eigen::Vector3d> centres = {{0, 0, 0}, {1, 0, 0}, {0.5, 0.3, 1}};
  const Eigen::Vector3d seen_from(4, -1, 3);
  const SeenFrom seen(centres);
  Random random(2);
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    // One Gauss-Newton step from the truth, with numeric derivatives.
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const auto& centre : centres) {
      Eigen::Matrix<double, 2, 3> jacobian;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = 1e-5 * Eigen::Vector3d::Unit(axis);
        jacobian.col(axis) =
            (Project(At(centre), kLandmark + step) - Project(At(centre), kLandmark - step)) / 2e-5;
      }
      const Eigen::Vector2d error(random.Gaussian(kSigmaPx), random.Gaussian(kSigmaPx));
      hessian += jacobian.transpose() * jacobian;
      gradient += jacobian.transpose() * error;
    }
    const Eigen::Vector3d moved = kLandmark + Eigen::Vector3d(hessian.ldlt().solve(gradient));
    const Eigen::Vector2d off = Project(At(seen_from), moved) - Project(At(seen_from), kLandmark);
    sum += off * off.transpose() / kDraws;
  }
  const Eigen::Matrix2d expected = seen.In(seen_from).Covariance();
  EXPECT_LT((expected - sum).norm(), 0.1 * sum.norm());
}

TEST(LandmarkNoise, GrowsWithTheParallaxThatNoViewHad) {
  const SeenFrom seen({{0, 0, 0}, {0.2, 0, 0}});
  const double between = seen.In({0.1, 0, 0}).SigmaPx();
  EXPECT_LT(between, kSigmaPx);
  EXPECT_GT(seen.In({2, 0, 0}).SigmaPx(), 5 * between);
  const PixelNoise sideways = seen.In({2, 0, 0});
  EXPECT_GT(sideways.xx, 20 * sideways.yy) << "along the epipolar line alone";
}

TEST(LandmarkNoise, IsFiniteWithoutParallax) {
  const SeenFrom seen({{0, 0, 0}, {0, 0, 0}});
  EXPECT_TRUE(std::isfinite(seen.In({5, 0, 0}).SigmaPx()));
  EXPECT_GT(seen.In({5, 0, 0}).SigmaPx(), 100 * kSigmaPx);
  EXPECT_LT(seen.In({0, 0, 0}).SigmaPx(), kSigmaPx);
}

TEST(LandmarkNoise, IsNoneBehindTheCamera) {
  const SeenFrom seen({{0, 0, 0}, {1, 0, 0}});
  EXPECT_EQ(seen.In({0, 0, 30}).SigmaPx(), 0);
}

TEST(LandmarkNoise, CountsTheErrorsCommonToAllPatches) {
  SeenFrom seen({{0, 0, 0}, {1, 0, 0}});
  Map& map = seen.builder.map;
  for (KeyframeId keyframe : {KeyframeId{0}, KeyframeId{1}})
    map.SetMeasurement(keyframe, seen.landmark, {{}, 0.05, true});
  const double before = seen.In({2, 0, 0}).SigmaPx();
  map.SetModelSigma(0.5);
  EXPECT_GT(seen.In({2, 0, 0}).SigmaPx(), 5 * before);
}

}  // namespace
}  // namespace deepuav
