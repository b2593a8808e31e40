#include "deepuav/patches/patch_alignment.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "deepuav/base/option_check.h"

namespace deepuav {
namespace {

constexpr int kRadius = 7;
constexpr int kSide = 2 * kRadius + 1;
constexpr int kStride = kSide + 1;  // 16 floats a row: whole vector registers.
constexpr int kPixels = kSide * kSide;
constexpr int kBorderedSide = kSide + 2;  // For central differences.

/// Rows of kStride values, the last of each of no meaning.
using Patch = std::array<float, kSide * kStride>;

double LevelFactor(int level) { return std::ldexp(1.0, level); }

/// From a pixel of level 0 to the same place in another level.
Eigen::Vector2d ToLevel(const Eigen::Vector2d& px, int level) {
  return ((px.array() + 0.5) / LevelFactor(level) - 0.5).matrix();
}

Eigen::Vector2d FromLevel(const Eigen::Vector2d& px, int level) {
  return ((px.array() + 0.5) * LevelFactor(level) - 0.5).matrix();
}

/// Which levels of the two pyramids show the patch at about the same size.
struct Levels {
  int reference = 0, image = 0;
};

std::optional<Levels> ChooseLevels(const Eigen::Matrix2d& image_from_reference,
                                   const ImagePyramid& reference, const ImagePyramid& image,
                                   double max_change) {
  double scale = std::sqrt(std::abs(image_from_reference.determinant()));
  Levels levels;
  while (scale > max_change) ++levels.image, scale /= 2;
  while (scale < 1 / max_change && scale > 0) ++levels.reference, scale *= 2;
  if (levels.image >= image.levels() || levels.reference >= reference.levels()) return std::nullopt;
  return levels;
}

float Interpolate(const GreyImage& image, float x, float y) {
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float a = x - static_cast<float>(x0), b = y - static_cast<float>(y0);
  const uint8_t* row = image[y0] + x0;
  const uint8_t* below = image[y0 + 1] + x0;
  const float top = static_cast<float>(row[0]) * (1 - a) + static_cast<float>(row[1]) * a;
  const float bottom = static_cast<float>(below[0]) * (1 - a) + static_cast<float>(below[1]) * a;
  return top * (1 - b) + bottom * b;
}

/// Whether the pixels around `px` that a step of `x` and `y` each way reaches can be interpolated.
bool Inside(const GreyImage& image, const Eigen::Vector2d& px, double x, double y) {
  return px.x() - x >= 0 && px.y() - y >= 0 && px.x() + x < image.cols - 1 &&
         px.y() + y < image.rows - 1;  // false for NaN
}

float Mean(const Patch& patch) {
  float sum = 0;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) sum += patch[static_cast<size_t>(v * kStride + u)];
  }
  return sum / kPixels;
}

float Dot(const Patch& a, const Patch& b) {
  std::array<float, kStride> sums{};
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kStride; ++u) {
      const auto i = static_cast<size_t>(v * kStride + u);
      sums[static_cast<size_t>(u)] += a[i] * b[i];
    }
  }
  float sum = 0;
  for (float s : sums) sum += s;
  return sum;
}

/// Takes the mean away and clears what is of no meaning.
void Centre(Patch* patch) {
  const float mean = Mean(*patch);
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) (*patch)[static_cast<size_t>(v * kStride + u)] -= mean;
    (*patch)[static_cast<size_t>(v * kStride + kSide)] = 0;
  }
}

void SubtractMultiple(float factor, const Patch& of, Patch* from) {
  for (size_t i = 0; i < of.size(); ++i) (*from)[i] -= factor * of[i];
}

/// The reference as the image should show it, and what a shift changes of it that gain and offset
/// do not explain.
struct Template {
  Patch values, slope_x, slope_y;
  float energy = 0;  ///< Sum of squares of `values`, which have no mean.
};

/// Nothing where it leaves the reference.
std::optional<Template> WarpReference(const GreyImage& reference, const Eigen::Vector2d& centre,
                                      const Eigen::Matrix2d& reference_from_image) {
  const Eigen::Matrix2d reach = reference_from_image.cwiseAbs() * (kRadius + 1);
  if (!Inside(reference, centre, reach.row(0).sum(), reach.row(1).sum())) return std::nullopt;
  std::array<float, kBorderedSide * kBorderedSide> bordered;
  const Eigen::Matrix2f warp = reference_from_image.cast<float>();
  for (int v = 0; v < kBorderedSide; ++v) {
    const Eigen::Vector2f row =
        centre.cast<float>() + warp.col(1) * static_cast<float>(v - kRadius - 1);
    for (int u = 0; u < kBorderedSide; ++u) {
      const auto step = static_cast<float>(u - kRadius - 1);
      bordered[static_cast<size_t>(v * kBorderedSide + u)] =
          Interpolate(reference, row.x() + warp(0, 0) * step, row.y() + warp(1, 0) * step);
    }
  }
  Template made;
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      const float* at = &bordered[static_cast<size_t>((v + 1) * kBorderedSide + u + 1)];
      const auto i = static_cast<size_t>(v * kStride + u);
      made.values[i] = *at;
      made.slope_x[i] = 0.5F * (at[1] - at[-1]);
      made.slope_y[i] = 0.5F * (at[kBorderedSide] - at[-kBorderedSide]);
    }
  }
  for (Patch* patch : {&made.values, &made.slope_x, &made.slope_y}) Centre(patch);
  made.energy = Dot(made.values, made.values);
  if (made.energy > 0) {
    for (Patch* slope : {&made.slope_x, &made.slope_y})
      SubtractMultiple(Dot(*slope, made.values) / made.energy, made.values, slope);
  }
  return made;
}

/// The image's patch around a position, without its mean.
void Cut(const GreyImage& image, const Eigen::Vector2d& px, Patch* patch) {
  const int x0 = static_cast<int>(std::floor(px.x())) - kRadius;
  const int y0 = static_cast<int>(std::floor(px.y())) - kRadius;
  const auto a = static_cast<float>(px.x() - std::floor(px.x()));
  const auto b = static_cast<float>(px.y() - std::floor(px.y()));
  const float w00 = (1 - a) * (1 - b), w10 = a * (1 - b), w01 = (1 - a) * b, w11 = a * b;
  for (int v = 0; v < kSide; ++v) {
    const uint8_t* row = image[y0 + v] + x0;
    const uint8_t* below = image[y0 + v + 1] + x0;
    float* out = &(*patch)[static_cast<size_t>(v * kStride)];
    for (int u = 0; u < kSide; ++u) {
      out[u] = w00 * static_cast<float>(row[u]) + w10 * static_cast<float>(row[u + 1]) +
               w01 * static_cast<float>(below[u]) + w11 * static_cast<float>(below[u + 1]);
    }
  }
  Centre(patch);
}

/// What is left of the image's patch once the template is taken away with its best gain.
struct Comparison {
  Patch residual;
  float gain = 0;
  double correlation = 0;
  double residual_variance = 0;  ///< Of a pixel.
};

constexpr int kFreeParameters = 4;  // shift, gain and offset

/// Far off, where little of the template shows, steps are too long.
constexpr double kMaxStepPx = 1;

Comparison Compare(const Template& reference, const GreyImage& image, const Eigen::Vector2d& px) {
  Comparison comparison;
  Cut(image, px, &comparison.residual);
  const float energy = Dot(comparison.residual, comparison.residual);
  const float common = Dot(comparison.residual, reference.values);
  comparison.gain = common / reference.energy;
  if (energy > 0) comparison.correlation = common / std::sqrt(energy * reference.energy);
  SubtractMultiple(comparison.gain, reference.values, &comparison.residual);
  comparison.residual_variance =
      Dot(comparison.residual, comparison.residual) / (kPixels - kFreeParameters);
  return comparison;
}

/// Aligns within one level of the image.
class Alignment {
 public:
  Alignment(const Template& reference, const GreyImage& image, const Eigen::Vector2d& start,
            double level_factor, const PatchOptions& options)
      : reference_(reference),
        image_(image),
        start_(start),
        px_(start),
        options_(options),
        level_factor_(level_factor) {
    const double xx = Dot(reference.slope_x, reference.slope_x);
    const double xy = Dot(reference.slope_x, reference.slope_y);
    const double yy = Dot(reference.slope_y, reference.slope_y);
    hessian_ << xx, xy, xy, yy;
    const double prior_sigma = options.prior_sigma_px / level_factor;
    prior_ = options.image_noise_grey * options.image_noise_grey / (prior_sigma * prior_sigma);
  }

  /// False where the patch leaves the image, runs away or is the reference's negative.
  bool Run() {
    const double max_shift = options_.max_shift_px / level_factor_;
    for (int i = 0; i < options_.max_iterations; ++i) {
      if (!Inside(image_, px_, kRadius + 1, kRadius + 1)) return false;
      const Comparison now = Compare(reference_, image_, px_);
      if (!(now.gain > 0)) return false;
      Eigen::Vector2d step = Step(now);
      if (step.norm() > kMaxStepPx) step *= kMaxStepPx / step.norm();
      px_ += step;
      if (!((px_ - start_).norm() <= max_shift)) return false;
      if (step.norm() * level_factor_ < options_.converged_px) break;
    }
    if (!Inside(image_, px_, kRadius + 1, kRadius + 1)) return false;
    result_ = Compare(reference_, image_, px_);
    return result_.gain > 0;
  }

  const Eigen::Vector2d& px() const { return px_; }
  const Comparison& result() const { return result_; }

  /// In pixels of the level. The residual counts as noise: it holds what the warp leaves
  /// unexplained.
  Eigen::Matrix2d Covariance() const {
    const double floor = options_.image_noise_grey * options_.image_noise_grey;
    const double variance = std::max(result_.residual_variance, floor);
    const double gain = result_.gain;
    const double inflation = options_.noise_factor * options_.noise_factor;
    const double prior_sigma = options_.prior_sigma_px / level_factor_;
    const Eigen::Matrix2d information =
        gain * gain / (inflation * variance) * SlopesWithoutNoise() +
        Eigen::Matrix2d::Identity() / (prior_sigma * prior_sigma);
    return information.inverse();
  }

 private:
  /// The template's own noise has slopes too, which tell nothing: half its variance a pixel.
  Eigen::Matrix2d SlopesWithoutNoise() const {
    const double noise = 0.5 * kPixels * options_.image_noise_grey * options_.image_noise_grey;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(hessian_);
    const Eigen::Vector2d along = (axes.eigenvalues().array() - noise).max(0).matrix();
    return axes.eigenvectors() * along.asDiagonal() * axes.eigenvectors().transpose();
  }

  Eigen::Vector2d Step(const Comparison& now) const {
    const double gain = now.gain;
    const Eigen::Vector2d slope(Dot(reference_.slope_x, now.residual),
                                Dot(reference_.slope_y, now.residual));
    const Eigen::Matrix2d damped = gain * gain * hessian_ + prior_ * Eigen::Matrix2d::Identity();
    return -damped.inverse() * (gain * slope + prior_ * (px_ - start_));
  }

  const Template& reference_;
  const GreyImage& image_;
  const Eigen::Vector2d start_;
  Eigen::Vector2d px_;
  const PatchOptions& options_;
  const double level_factor_;
  Eigen::Matrix2d hessian_;
  double prior_ = 0;
  Comparison result_;
};

}  // namespace

void PatchOptions::Check() const { CheckOptions("patches", *this); }

std::optional<AlignedPatch> AlignPatch(const ImagePyramid& reference,
                                       const Eigen::Vector2d& reference_px,
                                       const Eigen::Matrix2d& image_from_reference,
                                       const ImagePyramid& image, const Eigen::Vector2d& start_px,
                                       const PatchOptions& options) {
  const auto levels =
      ChooseLevels(image_from_reference, reference, image, options.max_scale_change);
  if (!levels) return std::nullopt;
  const double factor = LevelFactor(levels->image);
  const Eigen::Matrix2d reference_from_image =
      image_from_reference.inverse() * (factor / LevelFactor(levels->reference));
  const auto warped = WarpReference(reference.level(levels->reference),
                                    ToLevel(reference_px, levels->reference), reference_from_image);
  const double min_energy = kPixels * options.min_contrast_grey * options.min_contrast_grey;
  if (!warped || !(warped->energy >= min_energy)) return std::nullopt;

  Alignment alignment(*warped, image.level(levels->image), ToLevel(start_px, levels->image), factor,
                      options);
  if (!alignment.Run() || alignment.result().correlation < options.min_correlation)
    return std::nullopt;
  const PixelNoise noise(factor * factor * alignment.Covariance());
  return AlignedPatch{FromLevel(alignment.px(), levels->image), noise.Plus(options.min_sigma_px),
                      alignment.result().correlation};
}

}  // namespace deepuav
