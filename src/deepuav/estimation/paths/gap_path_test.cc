#include "deepuav/estimation/paths/gap_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/numeric_jacobian.h"
#include "support/synthetic_world.h"

namespace deepuav {
namespace {

constexpr int kFrames = 14, kBefore = 4, kAfter = 9;  // known up to and from there
constexpr double kRate_hz = 10;

/// A camera that hovers, drifts a little and turns by up to 90 degrees a second.
SE3 TruePose(int i) {
  const double t = i / kRate_hz;
  const Eigen::Vector3d centre(0.05 * std::sin(t), 0.04 * std::cos(1.3 * t), 10 + 0.03 * t);
  return SE3(RotationExp({0, 0, -1.5 * t}), Eigen::Vector3d::Zero()) *
         SE3(LookDown({0, 0, 0}, 0).rotation(), Eigen::Vector3d::Zero()) *
         SE3(Eigen::Quaterniond::Identity(), -centre);
}

class GapPathTest : public testing::Test {
 protected:
  GapPathTest() {
    Random random(1);
    world_.landmarks_world = LandmarksOnGround(3000, {-15, -15}, {15, 15}, 0.8, &random);
    problem_.motion = {0.02, 0.05};
    problem_.scene = {0.1, 0.03};
    for (int i = 0; i < kFrames; ++i) {
      const bool is_known = i <= kBefore || i >= kAfter;
      problem_.frames.push_back({i / kRate_hz, TruePose(is_known ? i : kBefore), is_known, {}});
    }
  }

  void Link(int a, int b, double wrong_share = 0) {
    FrameLink link{a, b, {}};
    const auto in_a = world_.Observe(TruePose(a), {0.7, 0}, &random_);
    const auto in_b = world_.Observe(TruePose(b), {0.7, wrong_share}, &random_);
    for (const auto& of_a : in_a) {
      for (const auto& of_b : in_b) {
        if (of_a.landmark == of_b.landmark) link.pairs.push_back({of_a.px, of_b.px, 1});
      }
    }
    link.pairs.resize(std::min<size_t>(link.pairs.size(), 100));
    problem_.links.push_back(std::move(link));
  }

  void SeeLandmarks(int i, size_t count) {
    const auto seen = world_.Observe(TruePose(i), {0.5, 0}, &random_);
    for (size_t k = 0; k < count; ++k) {
      const auto& one = seen[k * seen.size() / count];
      problem_.frames[static_cast<size_t>(i)].landmarks.push_back(
          {world_.landmarks_world[static_cast<size_t>(one.landmark)], one.px, 0.5});
    }
  }

  GapPath Solve() const { return SolveGapPath(world_.pinhole, problem_, {}).value(); }

  static Vector6d ErrorOf(const GapPath& path, int i) {
    return (TruePose(i) * path.poses[static_cast<size_t>(i)].cam_from_world.Inverse()).Log();
  }
  static double Worst(const GapPath& path, bool of_turn) {
    double worst = 0;
    for (int i = kBefore + 1; i < kAfter; ++i) {
      const Vector6d error = ErrorOf(path, i);
      worst = std::max(worst, of_turn ? error.tail<3>().norm() : error.head<3>().norm());
    }
    return worst;
  }

  SyntheticWorld world_;
  Random random_{2};
  GapPathProblem problem_;
};

TEST(BearingPair, JacobiansEqualCentralDifferences) {
  const Pinhole pinhole{450, 440, 376, 240};
  const MovingCamera a(SE3::Exp((Vector6d() << 0.1, -0.2, 0.5, 0.1, -0.3, 0.4).finished()));
  const MovingCamera b(SE3::Exp((Vector6d() << 0.3, 0.2, 0.1, 0.2, -0.1, 0.3).finished()));
  const BearingPair pair{{200, 300}, {350, 260}, 1};
  const BearingPairError at = LineariseBearingPair(pinhole, a, b, pair, 0.4);
  ASSERT_TRUE(at.is_usable);
  const auto moved = [](const MovingCamera& camera, const Eigen::VectorXd& d) {
    MovingCameraStep step = MovingCameraStep::Zero();
    step.head<6>() = d;
    return Moved(camera, step);
  };
  const auto of_a = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return LineariseBearingPair(pinhole, moved(a, d), b, pair, 0.4).error_px;
  };
  const auto of_b = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return LineariseBearingPair(pinhole, a, moved(b, d), pair, 0.4).error_px;
  };
  const auto of_depth = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    return LineariseBearingPair(pinhole, a, b, pair, 0.4 + d[0]).error_px;
  };
  EXPECT_LT((at.by_a - NumericJacobian(of_a, 6)).norm(), 1e-4);
  EXPECT_LT((at.by_b - NumericJacobian(of_b, 6)).norm(), 1e-4);
  EXPECT_LT((at.by_inverse_depth - NumericJacobian(of_depth, 1)).norm(), 1e-4);
}

TEST(BearingPair, BehindTheCameraIsNotUsable) {
  const Pinhole pinhole{450, 440, 376, 240};
  const MovingCamera a, b(SE3(RotationExp({0, 3, 0}), Eigen::Vector3d::Zero()));
  EXPECT_FALSE(LineariseBearingPair(pinhole, a, b, {{376, 240}, {376, 240}, 1}, 0.1).is_usable);
}

TEST_F(GapPathTest, ATurnOnTheSpotFollowsFromImages) {
  for (int i = kBefore; i < kAfter; ++i) Link(i, i + 1, 0.2);
  const GapPath path = Solve();
  EXPECT_LT(Worst(path, true), 0.002);
  EXPECT_LT(Worst(path, false), 0.03);
  for (const int count : path.link_inlier_count) EXPECT_GT(count, 55);
}

TEST_F(GapPathTest, ErrorsAreAsTheCovariancesSay) {
  double squares = 0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    problem_.links.clear();
    for (int i = kBefore; i < kAfter; ++i) Link(i, i + 1);
    const GapPath path = SolveGapPath(world_.pinhole, problem_, {.max_link_weight = 1000}).value();
    const Vector6d error = ErrorOf(path, 6);
    squares += error.tail<3>().dot(
        path.poses[6].covariance.bottomRightCorner<3, 3>().ldlt().solve(error.tail<3>()));
  }
  EXPECT_LT(squares / (3 * kTrials), 2);
  EXPECT_GT(squares / (3 * kTrials), 0.1);
}

TEST_F(GapPathTest, IsLeastSureInTheMiddleOfALongGap) {
  constexpr int kLong = 200, kSeconds = 20;
  problem_.frames.clear();
  for (int i = 0; i <= kLong; ++i) {
    const bool is_known = i < 2 || i > kLong - 2;
    problem_.frames.push_back({i / kRate_hz, TruePose(0), is_known, {}});
  }
  const GapPath path = Solve();
  const auto sigma = [&path](int i) {
    return std::sqrt(path.poses[static_cast<size_t>(i)].covariance(2, 2));
  };
  for (int i = 2; i < kLong / 2; ++i) {
    ASSERT_GT(sigma(i + 1), sigma(i)) << i;
    ASSERT_NEAR(sigma(i), sigma(kLong - i), 1e-3 * sigma(i)) << "the motion is the same backwards";
  }
  // A random walk of pace between two known ends (cubic spline): its variance in the middle.
  const double expected = std::sqrt(problem_.motion.travel * kSeconds * kSeconds * kSeconds / 192);
  EXPECT_NEAR(sigma(kLong / 2), expected, 0.05 * expected);
}

TEST_F(GapPathTest, WithoutImagesThePathIsSmooth) {
  const GapPath path = Solve();
  EXPECT_LT(Worst(path, true), 0.02);
  EXPECT_LT(Worst(path, false), 0.02);
  EXPECT_LT(path.travel_chi_square, 6 * 9);
  EXPECT_GT(path.poses[6].covariance(0, 0), path.poses[5].covariance(0, 0));
  EXPECT_EQ(path.poses[kBefore].covariance, Matrix6d::Zero());
}

TEST_F(GapPathTest, FewLandmarksTellThePlace) {
  problem_.motion = {1, 0.5};
  const double without = std::sqrt(Solve().poses[6].covariance(0, 0));
  for (int i = kBefore + 1; i < kAfter; ++i) SeeLandmarks(i, 6);
  problem_.frames[6].landmarks[0].px += Eigen::Vector2d(40, 0);
  const GapPath path = Solve();
  EXPECT_LT(std::sqrt(path.poses[6].covariance(0, 0)), 0.5 * without);
  EXPECT_LT(Worst(path, false), 0.03);
  EXPECT_EQ(path.poses[7].landmark_count, 6);
  EXPECT_EQ(path.poses[6].landmark_count, 5);
}

TEST_F(GapPathTest, AJumpIsFarFromSmooth) {
  for (int i = kAfter; i < kFrames; ++i) {
    SE3& pose = problem_.frames[static_cast<size_t>(i)].cam_from_world;
    pose = SE3(pose.rotation(), pose.translation() + Eigen::Vector3d(2, 0, 0));
  }
  EXPECT_GT(Solve().travel_chi_square, 9 * 6 * (kFrames - 1));
}

TEST_F(GapPathTest, NoMotionKnownIsNoPath) {
  problem_.motion = {};
  EXPECT_FALSE(SolveGapPath(world_.pinhole, problem_, {}));
  problem_.motion = {1, 1};
  problem_.frames.resize(1);
  EXPECT_FALSE(SolveGapPath(world_.pinhole, problem_, {}));
}

}  // namespace
}  // namespace deepuav
