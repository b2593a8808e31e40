#include "deepuav/simulation/flight/minimum_snap_curve.h"

#include <gtest/gtest.h>

#include "deepuav/base/error.h"
#include "deepuav/base/random.h"

namespace deepuav {
namespace {

FlatOutput RandomValue(Random* random) {
  return {random->Gaussian(10), random->Gaussian(10), random->Gaussian(10), random->Gaussian(1)};
}

struct Knots {
  std::vector<double> times_s;
  std::vector<FlatOutput> values;
};

Knots RandomKnots(int count, uint64_t seed) {
  Random random(seed);
  Knots knots;
  double time_s = 3;
  for (int i = 0; i < count; ++i) {
    knots.times_s.push_back(time_s);
    knots.values.push_back(RandomValue(&random));
    time_s += random.Uniform(0.6, 1.5);
  }
  return knots;
}

TEST(MinimumSnapCurve, PassesThroughItsKnots) {
  for (const int count : {2, 3, 12}) {
    const Knots knots = RandomKnots(count, 1);
    const MinimumSnapCurve curve(knots.times_s, knots.values);
    for (size_t i = 0; i < knots.values.size(); ++i)
      EXPECT_LT((curve.At(knots.times_s[i]).value - knots.values[i]).norm(), 1e-9) << count;
  }
}

TEST(MinimumSnapCurve, RestsAtBothEndsAndBeyond) {
  const Knots knots = RandomKnots(8, 2);
  const MinimumSnapCurve curve(knots.times_s, knots.values);
  for (const double t : {curve.start_s() - 1, curve.start_s(), curve.end_s(), curve.end_s() + 1}) {
    const FlatState state = curve.At(t);
    EXPECT_LT(state.velocity.norm() + state.acceleration.norm() + state.jerk.norm(), 1e-8);
  }
  EXPECT_EQ(curve.At(curve.end_s() + 1).value, curve.At(curve.end_s()).value);
}

TEST(MinimumSnapCurve, DerivativesAreThoseOfTheValue) {
  const Knots knots = RandomKnots(9, 3);
  const MinimumSnapCurve curve(knots.times_s, knots.values);
  const double h = 1e-4;
  for (double t = curve.start_s() + 0.013; t < curve.end_s() - 0.01; t += 0.0917) {
    const FlatState before = curve.At(t - h), at = curve.At(t), after = curve.At(t + h);
    EXPECT_LT(((after.value - before.value) / (2 * h) - at.velocity).norm(), 1e-4) << t;
    EXPECT_LT(((after.velocity - before.velocity) / (2 * h) - at.acceleration).norm(), 1e-3) << t;
    EXPECT_LT(((after.acceleration - before.acceleration) / (2 * h) - at.jerk).norm(), 1e-2) << t;
  }
}

// Derivatives 4 to 6 as differences of the jerk on either side of a knot.
TEST(MinimumSnapCurve, HasSixContinuousDerivatives) {
  const Knots knots = RandomKnots(7, 4);
  const MinimumSnapCurve curve(knots.times_s, knots.values);
  const double h = 1e-3;
  for (size_t i = 1; i + 1 < knots.times_s.size(); ++i) {
    const double t = knots.times_s[i];
    const auto jerk = [&](double at) { return curve.At(at).jerk; };
    // The jerk is a polynomial of degree 4 on either side: its differences extrapolate exactly.
    const auto sided = [&](double step) {
      const FlatOutput j0 = jerk(t), j1 = jerk(t + step), j2 = jerk(t + 2 * step),
                       j3 = jerk(t + 3 * step), j4 = jerk(t + 4 * step);
      const FlatOutput snap = (-25 * j0 + 48 * j1 - 36 * j2 + 16 * j3 - 3 * j4) / (12 * step);
      const FlatOutput crackle =
          (35 * j0 - 104 * j1 + 114 * j2 - 56 * j3 + 11 * j4) / (12 * step * step);
      return std::pair(snap, crackle);
    };
    const auto [snap_after, crackle_after] = sided(h);
    const auto [snap_before, crackle_before] = sided(-h);
    EXPECT_LT((snap_after - snap_before).norm(), 1e-4 * (1 + snap_after.norm())) << i;
    EXPECT_LT((crackle_after - crackle_before).norm(), 1e-2 * (1 + crackle_after.norm())) << i;
  }
}

double SquaredSnap(const MinimumSnapCurve& curve) {
  const double h = 1e-3;
  double sum = 0;
  for (double t = curve.start_s() + h; t < curve.end_s() - h; t += h)
    sum += ((curve.At(t + h / 2).jerk - curve.At(t - h / 2).jerk) / h).squaredNorm() * h;
  return sum;
}

// Any other knot in between makes the integral larger.
TEST(MinimumSnapCurve, HasTheLeastSnap) {
  const Knots knots = RandomKnots(5, 5);
  const MinimumSnapCurve best(knots.times_s, knots.values);
  Random random(6);
  for (int trial = 0; trial < 5; ++trial) {
    Knots other = knots;
    const double t = (knots.times_s[1] + knots.times_s[2]) / 2;
    other.times_s.insert(other.times_s.begin() + 2, t);
    other.values.insert(other.values.begin() + 2, best.At(t).value + RandomValue(&random) / 10);
    EXPECT_GT(SquaredSnap(MinimumSnapCurve(other.times_s, other.values)), SquaredSnap(best));
  }
}

TEST(MinimumSnapCurve, RefusesKnotsThatAreNone) {
  EXPECT_THROW(MinimumSnapCurve({0}, {FlatOutput::Zero()}), Error);
  EXPECT_THROW(MinimumSnapCurve({0, 1}, {FlatOutput::Zero()}), Error);
  EXPECT_THROW(MinimumSnapCurve({0, 0}, {FlatOutput::Zero(), FlatOutput::Ones()}), Error);
}

}  // namespace
}  // namespace deepuav
