#include "deepuav/estimation/bundle/student_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

/// Squares of errors in a plane whose deviation is `sigma` over the root of a mean of `freedom`
/// squares of normal numbers; 0: normal.
std::vector<double> Squares(int freedom, double sigma, int count) {
  Random random(3);
  std::vector<double> squares;
  for (int i = 0; i < count; ++i) {
    double mean = freedom == 0 ? 1 : 0;
    for (int k = 0; k < freedom; ++k) mean += std::pow(random.Gaussian(1), 2) / freedom;
    const double x = random.Gaussian(sigma), y = random.Gaussian(sigma);
    squares.push_back((x * x + y * y) / mean);
  }
  return squares;
}

TEST(StudentErrorsTest, TailsAndVarianceAreFound) {
  for (const int freedom : {2, 4, 8}) {
    const StudentErrors found = FitStudentErrors(Squares(freedom, 0.7, 20'000), 1);
    EXPECT_EQ(found.freedom, freedom);
    EXPECT_NEAR(found.variance, 0.49, 0.02) << freedom;
  }
}

TEST(StudentErrorsTest, NormalErrorsCountAlike) {
  const auto weights = StudentWeights(Squares(0, 2, 20'000), 1);
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 20'000, 1e-6);
  EXPECT_GT(*std::min_element(weights.begin(), weights.end()), 0.9);
}

TEST(StudentErrorsTest, LongTailsCountLittle) {
  auto squares = Squares(2, 1, 1000);
  squares.push_back(1e300);
  squares.push_back(std::numeric_limits<double>::infinity());
  const auto weights = StudentWeights(squares, 1);
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1002, 1e-6);
  EXPECT_LT(weights[1000], 1e-2);
  EXPECT_EQ(weights[1001], weights[1000]);
  EXPECT_GT(weights[1001], 0);
}

TEST(StudentErrorsTest, NoFewerDegreesThanAsked) {
  const auto squares = Squares(1, 1, 2000);
  EXPECT_LE(FitStudentErrors(squares, 0.5).freedom, 1.5);
  EXPECT_EQ(FitStudentErrors(squares, 2.5).freedom, 2.5);
}

TEST(StudentErrorsTest, WithoutErrorsWeightsAreFinite) {
  for (const double weight : StudentWeights(std::vector<double>(10, 0.0), 2))
    EXPECT_DOUBLE_EQ(weight, 1);
}

}  // namespace
}  // namespace deepuav
