#pragma once

#include <Eigen/Core>
#include <cmath>

namespace deepuav {

/// The covariance of a position in an image, px^2.
struct PixelNoise {
  float xx = 1, xy = 0, yy = 1;

  PixelNoise() = default;
  /// The same in all directions: a standard deviation is a noise, too.
  PixelNoise(double sigma_px)  // NOLINT(google-explicit-constructor)
      : xx(static_cast<float>(sigma_px * sigma_px)), yy(xx) {}
  explicit PixelNoise(const Eigen::Matrix2d& covariance)
      : xx(static_cast<float>(covariance(0, 0))),
        xy(static_cast<float>(covariance(0, 1))),
        yy(static_cast<float>(covariance(1, 1))) {}

  Eigen::Matrix2d Covariance() const {
    return (Eigen::Matrix2d() << double{xx}, double{xy}, double{xy}, double{yy}).finished();
  }
  /// Of the sum of two independent errors.
  PixelNoise operator+(const PixelNoise& other) const {
    PixelNoise sum = *this;
    sum.xx += other.xx;
    sum.xy += other.xy;
    sum.yy += other.yy;
    return sum;
  }
  /// With an independent error of `sigma_px` in every direction on top.
  PixelNoise Plus(double sigma_px) const { return *this + PixelNoise(sigma_px); }
  /// Standard deviation per axis, root of the mean over all directions.
  double SigmaPx() const { return std::sqrt(0.5 * (double{xx} + double{yy})); }
  /// Finite and positive definite.
  bool usable() const {
    const double determinant = double{xx} * yy - double{xy} * xy;
    return xx > 0 && yy > 0 && determinant > 0 && std::isfinite(xx) && std::isfinite(yy);
  }

  bool operator==(const PixelNoise&) const = default;
};

/// The lower triangular W with W^T W = covariance^-1, which turns errors in pixels into errors in
/// standard deviations.
struct Whitening {
  double xx = 1, yx = 0, yy = 1;

  Whitening() = default;
  /// Of a usable noise.
  explicit Whitening(const PixelNoise& noise) {
    const double l_xx = std::sqrt(double{noise.xx});
    const double l_yx = noise.xy / l_xx;
    const double l_yy = std::sqrt(noise.yy - l_yx * l_yx);
    xx = 1 / l_xx;
    yy = 1 / l_yy;
    yx = -l_yx * xx * yy;
  }

  /// W times a vector or a matrix of two rows.
  template <int Columns>
  Eigen::Matrix<double, 2, Columns> operator*(
      const Eigen::Matrix<double, 2, Columns>& error_px) const {
    Eigen::Matrix<double, 2, Columns> whitened;
    whitened.row(0) = xx * error_px.row(0);
    whitened.row(1) = yx * error_px.row(0) + yy * error_px.row(1);
    return whitened;
  }
  /// Mean over all directions of the squared length that an error of one pixel gets.
  double MeanSquaredGain() const { return 0.5 * (xx * xx + yx * yx + yy * yy); }
};

}  // namespace deepuav
