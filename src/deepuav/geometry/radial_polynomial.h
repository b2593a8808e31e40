#pragma once

#include <array>

namespace deepuav {

/// The radial part of a lens model: a point at undistorted radius r (the tangent of its angle from
/// the optical axis, or for the equidistant model that angle) appears at r (1 + k_1 r^2 + ... + k_4
/// r^8).
class RadialPolynomial {
 public:
  static constexpr int kMaxTerms = 4;

  explicit RadialPolynomial(const std::array<double, kMaxTerms>& k) : k_(k) {
    while (terms_ > 0 && k_[terms_ - 1] == 0) --terms_;
  }

  double Distort(double r) const { return r * Factor(r * r); }
  double Factor(double r2) const {
    double factor = 0;
    for (int i = terms_ - 1; i >= 0; --i) factor = (factor + k_[i]) * r2;
    return 1 + factor;
  }
  /// d Factor / d r2.
  double FactorSlope(double r2) const {
    double slope = 0;
    for (int i = terms_ - 1; i >= 0; --i) slope = slope * r2 + (i + 1) * k_[i];
    return slope;
  }

  /// The radius up to which Distort increases, `limit` at most.
  double OneToOneRadius(double limit) const;

  /// Whether `r` is below OneToOneRadius(limit), without the search for it where bounds suffice.
  bool IsOneToOneAt(double r, double limit) const;

  /// The radius in [0, end] that Distort maps to `distorted`, for `end` at most the OneToOneRadius
  /// and `distorted` between 0 and Distort(end).
  double Invert(double distorted, double end) const;

 private:
  std::array<double, kMaxTerms> k_;
  int terms_ = kMaxTerms;
};

}  // namespace deepuav
