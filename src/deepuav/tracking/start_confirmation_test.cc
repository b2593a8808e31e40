#include "deepuav/tracking/start_confirmation.h"

#include <gtest/gtest.h>

#include "support/estimation_problems.h"

namespace deepuav {
namespace {

/// Three views of a drone that flies to a coast far ahead, hardly any of whose points is of known
/// distance, and two solutions of the first two: the true motion, and a false one to the side that
/// makes up for it by turning, under which the points have a distance and a parallax.
class StartConfirmationTest : public ::testing::Test {
 protected:
  StartConfirmationTest() {
    Random random(4);
    const SE3 b_from_a(Eigen::Quaterniond::Identity(), {0, 0, -1});
    const SE3 c_from_a(Eigen::Quaterniond::Identity(), {0, 0, -2});
    for (const auto& point : LandmarksInBox(300, {-150, -90, 200}, {150, 60, 500}, &random)) {
      const auto pixel = [&](const SE3& cam_from_a) -> Eigen::Vector2d {
        return pinhole_.Project(cam_from_a * point) +
               Eigen::Vector2d(random.Gaussian(kNoise * kSigmaPx),
                               random.Gaussian(kNoise * kSigmaPx));
      };
      seen_.push_back({seen_.size(), {pixel(SE3()), pixel(b_from_a), pixel(c_from_a), kNoise}});
      true_.points_a.push_back(point);
    }
    true_.b_from_a = b_from_a;
    true_.valid.assign(seen_.size(), 1);
    true_.certain.assign(seen_.size(), 0);
    false_ = true_;
    false_.certain.assign(seen_.size(), 1);
    false_.certain_count = static_cast<int>(seen_.size());
    false_.b_from_a = SE3(RotationExp({0, 0.02, 0}), {-1, 0, 0});
    for (size_t i = 0; i < seen_.size(); ++i)
      false_.points_a[i] = 50 * pinhole_.Unproject(seen_[i].px.a_px);
  }

  Confirmation Confirm(const TwoViewSolution& solution) const {
    return ConfirmBy(pinhole_, solution, seen_, 1, options_, {});
  }

  static double SumOf(const Confirmation& confirmation) {
    double sum = 0;
    for (const double error : confirmation.errors) sum += error;
    return sum;
  }

  static constexpr double kNoise = 0.2, kSigmaPx = 0.3;
  const Pinhole pinhole_{450, 450, 376, 240};
  TwoViewOptions options_ = [] {
    TwoViewOptions options;
    options.min_certain = 60;
    return options;
  }();
  std::vector<SeenThrice> seen_;
  TwoViewSolution true_, false_;
};

TEST_F(StartConfirmationTest, ASolutionWithoutPointsOfKnownDistanceIsCompared) {
  const Confirmation found = Confirm(true_);
  EXPECT_EQ(found.matched, 0);
  EXPECT_EQ(found.confirmed, 0) << "it is no start";
  EXPECT_LT(SumOf(found), 0.3 * static_cast<double>(seen_.size())) << "but it explains the views";
}

TEST_F(StartConfirmationTest, AFalseSolutionIsNotAloneBesideTheTrueOne) {
  const std::vector<Confirmation> found = {Confirm(false_), Confirm(true_)};
  EXPECT_GT(found[0].confirmed, 0.9 * found[0].matched) << "within the bound on pixels";
  EXPECT_FALSE(IsAlone(0, found, 1.15));
}

TEST(IsAlone, WhereTheOthersLeaveEnoughMore) {
  std::vector<Confirmation> found(3);
  found[0].errors = {0.1, 0.1, 1};
  found[1].errors = {0.1, 0.13, 1};
  found[2].errors = {1, 1, 1};
  EXPECT_TRUE(IsAlone(0, found, 1.1));
  EXPECT_FALSE(IsAlone(0, found, 1.2)) << "what none explains does not count";
  EXPECT_FALSE(IsAlone(1, found, 1.1));
}

TEST_F(StartConfirmationTest, TheThirdViewsBaselineIsToldInThatOfTheFirstTwo) {
  TwoViewSolution known = true_;
  known.certain.assign(seen_.size(), 1);
  known.certain_count = static_cast<int>(seen_.size());
  const Confirmation found = Confirm(known);
  EXPECT_NEAR(found.baseline_ratio, 1, 0.1);
  EXPECT_EQ(found.matched, static_cast<int>(seen_.size()));
  EXPECT_EQ(found.confirmed, found.matched);
}

TEST_F(StartConfirmationTest, OfViewsThatShareNothingNothingIsConfirmed) {
  seen_.clear();
  const Confirmation found = Confirm(true_);
  EXPECT_EQ(found.matched, 0);
  EXPECT_TRUE(found.errors.empty());
}

TEST(LeastSigma, IsThatOfTheBestSolution) {
  TwoViewResult result;
  EXPECT_TRUE(std::isinf(LeastSigmaPx(result)));
  result.solutions.resize(2);
  result.solutions[0].sigma_px = 0.7;
  result.solutions[1].sigma_px = 0.4;
  EXPECT_EQ(LeastSigmaPx(result), 0.4);
}

}  // namespace
}  // namespace deepuav
