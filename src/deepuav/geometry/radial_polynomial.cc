#include "deepuav/geometry/radial_polynomial.h"

#include <algorithm>
#include <cmath>

namespace deepuav {
namespace {

constexpr int kMaxDegree = RadialPolynomial::kMaxTerms;
using Coefficients = std::array<double, kMaxDegree + 1>;  // ascending

double Evaluate(const Coefficients& coefficients, int degree, double x) {
  double value = 0;
  for (int i = degree; i >= 0; --i) value = value * x + coefficients[i];
  return value;
}

// Halves [low, high], at whose ends the polynomial has different signs, down to its root.
double Bisect(const Coefficients& coefficients, int degree, double low, double high) {
  constexpr double kTolerance = 1e-14;
  const bool positive = Evaluate(coefficients, degree, low) > 0;
  while (high - low > kTolerance * high) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;  // no number between: the root is at zero
    ((Evaluate(coefficients, degree, middle) > 0) == positive ? low : high) = middle;
  }
  return low;
}

// Fills `roots` with the places in (0, end), ascending, where the polynomial changes sign, and
// returns their number. Between the roots of its derivative it is monotone, so bisection finds
// each.
int FindRoots(const Coefficients& coefficients, int degree, double end, Coefficients* roots) {
  if (degree == 0) return 0;
  Coefficients derivative{};
  for (int i = 1; i <= degree; ++i) derivative[i - 1] = i * coefficients[i];
  Coefficients bounds{};
  const int turns = FindRoots(derivative, degree - 1, end, &bounds);
  bounds[turns] = end;

  int count = 0;
  double low = 0;
  for (int i = 0; i <= turns; ++i) {
    const double high = bounds[i];
    if ((Evaluate(coefficients, degree, low) > 0) != (Evaluate(coefficients, degree, high) > 0)) {
      (*roots)[count++] = Bisect(coefficients, degree, low, high);
    }
    low = high;
  }
  return count;
}

}  // namespace

double RadialPolynomial::OneToOneRadius(double limit) const {
  Coefficients slope{1};  // of Distort, as a polynomial in r^2
  for (int i = 0; i < terms_; ++i) slope[i + 1] = (2 * i + 3) * k_[i];
  Coefficients roots{};
  const int count = FindRoots(slope, terms_, limit * limit, &roots);
  return count == 0 ? limit : std::sqrt(roots[0]);
}

bool RadialPolynomial::IsOneToOneAt(double r, double limit) const {
  if (!(r < limit)) return false;
  // Of the slope in r^2, 1 + a r^2 + b r^4 + ..., the least value of the first three terms is
  // known, and each of the others is least at 0 or at r.
  const double r2 = r * r, a = 3 * k_[0], b = 5 * k_[1];
  const double lowest_at = b > 0 ? std::clamp(-a / (2 * b), 0.0, r2) : r2;
  double bound = std::min(1.0, 1 + lowest_at * (a + b * lowest_at)), power = r2 * r2;
  for (int i = 2; i < terms_; ++i) {
    power *= r2;
    bound += std::min(0.0, (2 * i + 3) * k_[i] * power);
  }
  return bound > 0 || r < OneToOneRadius(limit);
}

// Newton's method, kept inside a shrinking bracket.
double RadialPolynomial::Invert(double distorted, double end) const {
  constexpr int kMaxIterations = 100;
  constexpr double kTolerance = 1e-15;
  double low = 0, high = end, r = std::min(distorted, end);
  for (int i = 0; i < kMaxIterations; ++i) {
    const double r2 = r * r, factor = Factor(r2), error = r * factor - distorted;
    (error > 0 ? high : low) = r;
    double next = r - error / (factor + 2 * r2 * FactorSlope(r2));
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= kTolerance * end) return next;
    r = next;
  }
  return r;
}

}  // namespace deepuav
