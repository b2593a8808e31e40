#pragma once

#include <algorithm>
#include <cmath>

namespace deepuav {

/// The trust of Levenberg-Marquardt (Nielsen 1999, section 2).
class LevenbergDamping {
 public:
  LevenbergDamping(double initial, double min, double max)
      : value_(initial), min_(min), max_(max) {}

  double value() const { return value_; }
  bool Exhausted() const { return value_ > max_; }
  /// `gain_ratio`: the decrease of the cost over that of the quadratic model.
  void Accept(double gain_ratio) {
    value_ *= std::max(1.0 / 3, 1 - std::pow(2 * gain_ratio - 1, 3));
    value_ = std::max(value_, min_);
    growth_ = 2;
  }
  void Reject() {
    value_ *= growth_;
    growth_ *= 2;
  }

 private:
  double value_;
  double min_, max_;
  double growth_ = 2;
};

}  // namespace deepuav
