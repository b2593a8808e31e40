#include "deepuav/estimation/solvers/six_rows.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

namespace deepuav {
namespace {

TEST(SubtractSixBySix, IsTheProductOfAPartOfALargerMatrix) {
  const Eigen::Matrix<double, 6, 3> a = Eigen::Matrix<double, 6, 3>::Random();
  const Eigen::Matrix<double, 3, 6> b = Eigen::Matrix<double, 3, 6>::Random();
  Eigen::Matrix<double, 14, 6> out = Eigen::Matrix<double, 14, 6>::Random();
  Eigen::Matrix<double, 14, 6> expected = out;
  expected.middleRows<6>(5) -= a * b;
  SubtractSixBySix<3>(a.data(), 6, b.data(), 1, 3, out.data() + 5, 14);
  EXPECT_LT((out - expected).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(SubtractSixBySix, TakesATransposedFactor) {
  Eigen::Matrix<double, 18, 6> panel = Eigen::Matrix<double, 18, 6>::Random();
  const Eigen::Matrix<double, 6, 6> block = Eigen::Matrix<double, 6, 6>::Random();
  Eigen::Matrix<double, 6, 6> out = Eigen::Matrix<double, 6, 6>::Zero();
  SubtractSixBySix<6>(panel.data() + 6, 18, block.data(), 6, 1, out.data(), 6);
  EXPECT_LT((out + panel.middleRows<6>(6) * block.transpose()).cwiseAbs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace deepuav
