#include "deepuav/estimation/bundle/lens_correction.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "deepuav/base/error.h"

namespace deepuav {
namespace {

/// A pixel of an image and the ray that it shows.
struct SeenRay {
  Eigen::Vector2d px;
  Eigen::Vector3d ray_cam;
};

constexpr int kGridSteps = 16;

/// Of a grid over the image, where both the calibration and what took its pixels have a ray.
std::vector<SeenRay> RaysOver(const Camera& calibrated, const Camera& residual) {
  std::vector<SeenRay> rays;
  for (int row = 0; row <= kGridSteps; ++row) {
    for (int column = 0; column <= kGridSteps; ++column) {
      const Eigen::Vector2d px(column * (calibrated.width - 1.0) / kGridSteps,
                               row * (calibrated.height - 1.0) / kGridSteps);
      const auto undistorted = calibrated.Undistort(px);
      const auto correct = undistorted ? residual.Undistort(*undistorted) : std::nullopt;
      if (correct) rays.push_back({px, residual.pinhole.Unproject(*correct)});
    }
  }
  return rays;
}

std::vector<SeenRay> RaysOver(const Camera& camera) {
  Camera none;
  none.pinhole = camera.pinhole;
  return RaysOver(camera, none);
}

Eigen::VectorXd ParametersOf(const Camera& camera) {
  const auto coefficients = static_cast<Eigen::Index>(camera.distortion.size());
  Eigen::VectorXd parameters(4 + coefficients);
  parameters << camera.pinhole.fx, camera.pinhole.fy, camera.pinhole.cx, camera.pinhole.cy,
      Eigen::Map<const Eigen::VectorXd>(camera.distortion.data(), coefficients);
  return parameters;
}

Camera WithParameters(Camera camera, const Eigen::VectorXd& parameters) {
  camera.pinhole = {parameters[0], parameters[1], parameters[2], parameters[3]};
  for (size_t i = 0; i < camera.distortion.size(); ++i)
    camera.distortion[i] = parameters[static_cast<Eigen::Index>(i) + 4];
  return camera;
}

/// Pixel errors, two a ray; not finite where the camera does not see it.
Eigen::VectorXd ErrorsOf(const Camera& camera, const std::vector<SeenRay>& rays) {
  Eigen::VectorXd errors(2 * static_cast<Eigen::Index>(rays.size()));
  for (size_t i = 0; i < rays.size(); ++i) {
    const auto seen = camera.Distort(rays[i].ray_cam);
    errors.segment<2>(2 * static_cast<Eigen::Index>(i)) =
        seen ? Eigen::Vector2d(*seen - rays[i].px) : Eigen::Vector2d::Constant(std::nan(""));
  }
  return errors;
}

/// Gauss-Newton from a camera that is nearly right, by numeric derivatives.
Camera FitTo(const std::vector<SeenRay>& rays, Camera camera) {
  constexpr int kSteps = 8;
  constexpr double kPixelStep = 1e-3, kCoefficientStep = 1e-6;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::VectorXd parameters = ParametersOf(camera), errors = ErrorsOf(camera, rays);
    Eigen::MatrixXd jacobian(errors.size(), parameters.size());
    for (Eigen::Index i = 0; i < parameters.size(); ++i) {
      const double delta = i < 4 ? kPixelStep : kCoefficientStep;
      Eigen::VectorXd moved = parameters;
      moved[i] += delta;
      jacobian.col(i) = (ErrorsOf(WithParameters(camera, moved), rays) - errors) / delta;
    }
    const Eigen::VectorXd change =
        (jacobian.transpose() * jacobian).ldlt().solve(-jacobian.transpose() * errors);
    if (!change.allFinite()) break;
    camera = WithParameters(camera, parameters + change);
  }
  return camera;
}

bool IsPossible(const Camera& camera) {
  try {
    camera.Check("");
    return true;
  } catch (const Error&) {
    return false;
  }
}

Camera ResidualCamera(const BundleCamera& taken_by) {
  Camera residual;
  residual.pinhole = taken_by.pinhole;
  residual.lens = LensModel::kRadialTangential;
  residual.distortion = {taken_by.k1, taken_by.k2, taken_by.p1, taken_by.p2};
  return residual;
}

/// Two lenses of Brown's model, one after the other, are nearly one.
Camera FirstGuess(const Camera& calibrated, const Camera& residual) {
  Camera camera = calibrated;
  camera.pinhole = residual.pinhole;
  camera.lens = LensModel::kRadialTangential;
  // Their product has higher terms than each.
  constexpr size_t kWithThirdRadial = 5;
  const bool has_lens = calibrated.lens == LensModel::kRadialTangential;
  camera.distortion.resize(has_lens ? kWithThirdRadial : residual.distortion.size(), 0);
  for (size_t i = 0; i < residual.distortion.size(); ++i)
    camera.distortion[i] += residual.distortion[i];
  return camera;
}

/// Root mean square.
double MeanErrorPx(const Camera& camera, const std::vector<SeenRay>& rays) {
  return std::sqrt(ErrorsOf(camera, rays).squaredNorm() / static_cast<double>(rays.size()));
}

}  // namespace

double MeanShiftPx(const Camera& camera, const Camera& other) {
  const Eigen::VectorXd errors = ErrorsOf(other, RaysOver(camera));
  double squared = 0, seen = 0;
  for (Eigen::Index i = 0; i < errors.size(); i += 2) {
    const double error = errors.segment<2>(i).squaredNorm();
    if (!std::isfinite(error)) continue;
    squared += error;
    ++seen;
  }
  return seen > 0 ? std::sqrt(squared / seen) : std::numeric_limits<double>::infinity();
}

std::optional<LensCorrection> LensCorrection::Of(const Camera& calibrated,
                                                 const BundleCamera& taken_by,
                                                 double max_error_px) {
  if (calibrated.lens == LensModel::kEquidistant) return std::nullopt;
  LensCorrection correction;
  correction.residual_ = ResidualCamera(taken_by);
  const std::vector<SeenRay> rays = RaysOver(calibrated, correction.residual_);
  constexpr size_t kMostOfTheImage = kGridSteps * kGridSteps;
  if (rays.size() < kMostOfTheImage) return std::nullopt;
  Camera& camera = correction.camera_ = FirstGuess(calibrated, correction.residual_);
  if (calibrated.lens == LensModel::kRadialTangential) camera = FitTo(rays, camera);
  if (!IsPossible(camera)) return std::nullopt;
  if (!(MeanErrorPx(camera, rays) <= max_error_px)) return std::nullopt;  // also if not a number
  correction.mean_shift_px_ = deepuav::MeanShiftPx(camera, calibrated);
  return correction;
}

std::optional<LensCorrection> LensCorrection::To(const BundleCamera& lens,
                                                 const Camera& calibrated) {
  LensCorrection correction;
  Camera& camera = correction.camera_ = calibrated;
  const Camera found = ResidualCamera(lens);
  camera.pinhole = found.pinhole;
  camera.lens = found.lens;
  camera.distortion = found.distortion;
  if (!IsPossible(camera)) return std::nullopt;
  correction.calibrated_ = calibrated;
  correction.mean_shift_px_ = deepuav::MeanShiftPx(camera, calibrated);
  return correction;
}

Eigen::Vector2d LensCorrection::Correct(const Eigen::Vector2d& px) const {
  if (calibrated_) {
    const auto image_px = calibrated_->Distort(calibrated_->pinhole.Unproject(px));
    return (image_px ? camera_.Undistort(*image_px) : std::nullopt).value_or(px);
  }
  const auto seen = residual_.Undistort(px);
  if (!seen) return px;  // far outside of the image
  return camera_.pinhole.Project(residual_.pinhole.Unproject(*seen));
}

}  // namespace deepuav
