#include "deepuav/estimation/two_views/three_view.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/estimation_problems.h"

namespace deepuav {
namespace {

constexpr double kMaxErrorPx = 1.5;

/// Three views of a box, their pixels with noise, and the truth.
struct ThreeViewTest : testing::Test {
  ThreeViewTest() {
    Random random(1);
    truth.b_from_a = SE3(RotationExp({0.01, 0.02, 0}), {-0.5, 0, -0.2});
    truth.c_from_a = SE3(RotationExp({0.02, 0.05, 0.01}), {-1, 0.1, -0.3});
    for (const auto& point : LandmarksInBox(200, {-4, -3, 6}, {4, 3, 15}, &random)) {
      const auto pixel = [&](const SE3& cam_from_a) -> Eigen::Vector2d {
        return pinhole.Project(cam_from_a * point) +
               Eigen::Vector2d(random.Gaussian(0.3), random.Gaussian(0.3));
      };
      triples.push_back({pixel(SE3()), pixel(truth.b_from_a), pixel(truth.c_from_a)});
      truth.points_a.push_back(point);
    }
  }

  double DirectionError(const ThreeViews& views) const {
    return (views.c_from_a.translation().normalized() - truth.c_from_a.translation().normalized())
        .norm();
  }

  const Pinhole pinhole{450, 450, 376, 240};
  ThreeViews truth;
  std::vector<PixelTriple> triples;
};

TEST_F(ThreeViewTest, AdjustmentFindsThePosesFromNearThem) {
  ThreeViews views = truth;
  views.b_from_a =
      SE3::Exp((Vector6d() << 0.03, 0.02, -0.01, 0.002, -0.002, 0.001).finished()) * views.b_from_a;
  views.c_from_a =
      SE3::Exp((Vector6d() << -0.03, 0.03, 0.02, -0.002, 0.002, 0.001).finished()) * views.c_from_a;
  const double before = DirectionError(views);
  AdjustThreeViews(pinhole, triples, kMaxErrorPx, &views);
  EXPECT_LT(DirectionError(views), 0.02);
  EXPECT_LT(DirectionError(views), 0.3 * before);
  EXPECT_LT((views.c_from_a * truth.c_from_a.Inverse()).Angle(), 0.002);
}

TEST_F(ThreeViewTest, AWrongMatchNeitherMovesThePosesNorFits) {
  triples[7].c_px.y() += 40;
  ThreeViews views = truth;
  AdjustThreeViews(pinhole, triples, kMaxErrorPx, &views);
  EXPECT_LT(DirectionError(views), 0.02);
  const std::vector<double> errors = TruncatedErrors(pinhole, triples, views, kMaxErrorPx);
  EXPECT_EQ(errors[7], 1);
  int fit = 0;
  for (double error : errors) fit += error < 1;
  EXPECT_GT(fit, 190);
}

TEST_F(ThreeViewTest, PointsBehindAViewTakeNoPartAndDoNotFit) {
  ThreeViews views = truth;
  views.points_a[3] = {0, 0, -5};
  views.points_a[4].setZero();
  AdjustThreeViews(pinhole, triples, kMaxErrorPx, &views);
  EXPECT_EQ(views.points_a[3], Eigen::Vector3d(0, 0, -5));
  const std::vector<double> errors = TruncatedErrors(pinhole, triples, views, kMaxErrorPx);
  EXPECT_EQ(errors[3], 1);
  EXPECT_EQ(errors[4], 1);
  EXPECT_LT(errors[5], 1);
}

TEST_F(ThreeViewTest, PixelsThatAreNoneFitNothingAndMoveNothing) {
  ThreeViews expected = truth;
  const std::vector<PixelTriple> whole = triples;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (Eigen::Vector2d PixelTriple::*view :
       {&PixelTriple::a_px, &PixelTriple::b_px, &PixelTriple::c_px}) {
    for (const double bad : {nan, std::numeric_limits<double>::infinity()}) {
      triples = whole;
      (triples[9].*view).y() = bad;
      ThreeViews views = truth;
      EXPECT_EQ(TruncatedErrors(pinhole, triples, views, kMaxErrorPx)[9], 1);
      AdjustThreeViews(pinhole, triples, kMaxErrorPx, &views);
      EXPECT_LT(DirectionError(views), 0.02);
      EXPECT_EQ(views.points_a[9], truth.points_a[9]);
    }
  }
}

TEST_F(ThreeViewTest, ErrorsAreTheLargestOfTheThreeOverTheBound) {
  triples.clear();
  for (const Eigen::Vector3d& point : truth.points_a) {
    triples.push_back({pinhole.Project(point), pinhole.Project(truth.b_from_a * point),
                       pinhole.Project(truth.c_from_a * point)});
  }
  triples[0].b_px.x() += 0.5 * kMaxErrorPx;
  triples[1].a_px.y() -= 0.2 * kMaxErrorPx;
  triples[1].c_px.y() -= 0.8 * kMaxErrorPx;
  triples[2].c_px.x() += 3 * kMaxErrorPx;
  const std::vector<double> errors = TruncatedErrors(pinhole, triples, truth, kMaxErrorPx);
  EXPECT_NEAR(errors[0], 0.25, 1e-9);
  EXPECT_NEAR(errors[1], 0.64, 1e-9);
  EXPECT_EQ(errors[2], 1);
  EXPECT_LT(errors[3], 1e-18);
}

TEST_F(ThreeViewTest, WeightedErrorsAreOverWhatATriplesNoiseAllows) {
  triples.clear();
  for (const Eigen::Vector3d& point : truth.points_a) {
    triples.push_back({pinhole.Project(point), pinhole.Project(truth.b_from_a * point),
                       pinhole.Project(truth.c_from_a * point)});
  }
  for (int i : {0, 1, 2}) triples[static_cast<size_t>(i)].b_px.x() += 0.2 * kMaxErrorPx;
  triples[1].noise_ratio = 0.4;
  triples[2].noise_ratio = 0.1;
  const std::vector<double> errors = WeightedErrors(pinhole, triples, truth, kMaxErrorPx);
  EXPECT_NEAR(errors[0], 0.04, 1e-9);
  EXPECT_NEAR(errors[1], 0.25, 1e-9);
  EXPECT_EQ(errors[2], 1);
}

TEST_F(ThreeViewTest, WhatWasMeasuredHoldsThePosesMore) {
  const ThreeViews at_first = [&] {
    ThreeViews views = truth;
    AdjustThreeViews(pinhole, triples, kMaxErrorPx, &views);
    return views;
  }();
  for (size_t i = 0; i < triples.size(); i += 2) {
    const Eigen::Vector3d& point = truth.points_a[i];
    triples[i] = {pinhole.Project(point), pinhole.Project(truth.b_from_a * point),
                  pinhole.Project(truth.c_from_a * point), 0.1};
  }
  ThreeViews views = truth;
  AdjustThreeViews(pinhole, triples, kMaxErrorPx, &views);
  EXPECT_LT(DirectionError(views), 0.3 * DirectionError(at_first));
}

TEST_F(ThreeViewTest, OfNothingNothingMoves) {
  ThreeViews views = truth;
  views.points_a.clear();
  AdjustThreeViews(pinhole, {}, kMaxErrorPx, &views);
  EXPECT_EQ(views.b_from_a.translation(), truth.b_from_a.translation());
  EXPECT_EQ(views.c_from_a.translation(), truth.c_from_a.translation());
  EXPECT_TRUE(TruncatedErrors(pinhole, {}, views, kMaxErrorPx).empty());
}

}  // namespace
}  // namespace deepuav
