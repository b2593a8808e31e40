#include <gtest/gtest.h>

#include <cmath>

#include "deepuav/estimation/solvers/damped_gauss_newton.h"
#include "deepuav/estimation/solvers/levenberg_damping.h"

namespace deepuav {
namespace {

using Equations = NormalEquations<2>;
using Vector2 = Equations::Vector;

/// Half the squared residual r(x), its Jacobian J: J^T J, J^T r.
template <typename Residual, typename Jacobian>
auto Lineariser(const Residual& residual, const Jacobian& jacobian) {
  return [=](const Vector2& x) {
    Equations equations;
    const Vector2 r = residual(x);
    const Equations::Matrix j = jacobian(x);
    equations.hessian = j.transpose() * j;
    equations.gradient = j.transpose() * r;
    equations.cost = r.squaredNorm();
    return equations;
  };
}

const auto kAdd = [](const Vector2& x, const Vector2& step) { return Vector2(x + step); };

// Rosenbrock's valley as a sum of squares: its minimum is (1, 1).
const auto kValley =
    Lineariser([](const Vector2& x) { return Vector2(10 * (x.y() - x.x() * x.x()), 1 - x.x()); },
               [](const Vector2& x) {
                 Equations::Matrix j;
                 j << -20 * x.x(), 10, -1, 0;
                 return j;
               });

TEST(MinimiseDamped, FindsTheMinimumOfACurvedValley) {
  const Vector2 found = MinimiseDamped(Vector2(-1.2, 1), 100, kValley, kAdd);
  EXPECT_LT((found - Vector2(1, 1)).norm(), 1e-6);
}

TEST(MinimiseDamped, NeverRaisesTheCost) {
  double last = kValley(Vector2(-1.2, 1)).cost;
  for (int iterations = 1; iterations < 30; ++iterations) {
    const double cost = kValley(MinimiseDamped(Vector2(-1.2, 1), iterations, kValley, kAdd)).cost;
    EXPECT_LE(cost, last) << iterations;
    last = cost;
  }
}

TEST(MinimiseDamped, OfALinearProblemTakesOneStep) {
  const auto linear = Lineariser([](const Vector2& x) { return Vector2(2 * x.x() - 4, x.y() + 3); },
                                 [](const Vector2&) {
                                   Equations::Matrix j;
                                   j << 2, 0, 0, 1;
                                   return j;
                                 });
  EXPECT_LT((MinimiseDamped(Vector2(50, 50), 1, linear, kAdd) - Vector2(2, -3)).norm(), 1e-3);
}

TEST(MinimiseDamped, StaysWhereNothingIsDetermined) {
  const auto flat = [](const Vector2&) { return Equations{}; };
  const Vector2 start(3, 4);
  EXPECT_EQ(MinimiseDamped(start, 50, flat, kAdd), start);
}

TEST(MinimiseDamped, StaysWhereTheCostIsNoNumber) {
  const auto broken = [](const Vector2& x) {
    Equations equations = kValley(x);
    if (x != Vector2(-1.2, 1)) equations.cost = std::nan("");
    return equations;
  };
  EXPECT_EQ(MinimiseDamped(Vector2(-1.2, 1), 50, broken, kAdd), Vector2(-1.2, 1));
}

TEST(LevenbergDamping, FallsToAThirdAtBestAndNotBelowItsBound) {
  LevenbergDamping damping(1, 0.2, 100);
  damping.Accept(1);
  EXPECT_DOUBLE_EQ(damping.value(), 1.0 / 3);
  damping.Accept(1);
  EXPECT_DOUBLE_EQ(damping.value(), 0.2);
}

TEST(LevenbergDamping, GrowsFasterWithEveryRejectionUntilItIsExhausted) {
  LevenbergDamping damping(1, 0.1, 1000);
  double expected = 1, growth = 2;
  for (int i = 0; i < 4; ++i) {
    EXPECT_FALSE(damping.Exhausted());
    damping.Reject();
    expected *= growth;
    growth *= 2;
    EXPECT_DOUBLE_EQ(damping.value(), expected);
  }
  EXPECT_TRUE(damping.Exhausted());
}

TEST(LevenbergDamping, RisesWhereTheModelPromisedTooMuch) {
  LevenbergDamping damping(1, 0.1, 100);
  damping.Accept(0.5);  // half of what was promised: as it was
  EXPECT_DOUBLE_EQ(damping.value(), 1);
  damping.Accept(0.1);
  EXPECT_GT(damping.value(), 1);
}

TEST(LevenbergDamping, ASuccessEndsTheGrowthOfRejections) {
  LevenbergDamping damping(1, 0.001, 1e9);
  for (int i = 0; i < 3; ++i) damping.Reject();
  damping.Accept(0.5);
  const double before = damping.value();
  damping.Reject();
  EXPECT_DOUBLE_EQ(damping.value(), 2 * before);
}

}  // namespace
}  // namespace deepuav
