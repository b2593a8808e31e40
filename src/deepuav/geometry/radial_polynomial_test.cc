#include "deepuav/geometry/radial_polynomial.h"

#include <gtest/gtest.h>

#include "deepuav/base/random.h"

namespace deepuav {
namespace {

TEST(RadialPolynomial, IsOneToOneBelowItsFold) {
  Random random(1);
  int folds = 0;
  for (int i = 0; i < 5000; ++i) {
    std::array<double, 4> k{};
    const int terms = random.Index(5);
    for (int t = 0; t < terms; ++t) k[static_cast<size_t>(t)] = random.Uniform(-0.5, 0.5);
    const RadialPolynomial polynomial(k);
    const double limit = random.Uniform(0.5, 5);
    const double fold = polynomial.OneToOneRadius(limit);
    folds += fold < limit;
    for (double r : {0.0, 0.3 * fold, 0.999999 * fold, 1.000001 * fold, random.Uniform(0, 6)})
      EXPECT_EQ(polynomial.IsOneToOneAt(r, limit), r < fold) << r << " against " << fold;
  }
  EXPECT_GT(folds, 1000);
  EXPECT_LT(folds, 4500);
}

TEST(RadialPolynomial, DistortsSteadilyBelowItsFold) {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const RadialPolynomial polynomial({random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5),
                                       random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5)});
    const double fold = polynomial.OneToOneRadius(3);
    double last = -1;
    for (int step = 0; step <= 100; ++step) {
      const double distorted = polynomial.Distort(fold * step / 100);
      EXPECT_GT(distorted, last - 1e-9);
      last = distorted;
    }
  }
}

TEST(RadialPolynomial, InvertUndoesDistort) {
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const RadialPolynomial polynomial({random.Uniform(-0.4, 0.4), random.Uniform(-0.2, 0.2), 0, 0});
    const double end = 0.99 * polynomial.OneToOneRadius(3), r = random.Uniform(0, end);
    EXPECT_NEAR(polynomial.Invert(polynomial.Distort(r), end), r, 1e-7);
  }
}

}  // namespace
}  // namespace deepuav
