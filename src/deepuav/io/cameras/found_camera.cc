#include "deepuav/io/cameras/found_camera.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/geometry/camera_scale.h"

namespace deepuav {
namespace {

// Standard deviations of the focal length over it. EXIF gives whole millimetres, of a lens whose
// crop by stabilisation and video modes it leaves out.
constexpr double kSigmaByHand = 0.1, kSigmaXmp = 0.03, kSigmaExif = 0.1, kSigmaGuess = 0.5;
// Of a lens that was measured by itself: it changes with temperature and focus.
constexpr double kSigmaMeasured = 0.005;

// The optical centre lies near the middle, by this share of the image's sides.
constexpr double kNearMiddle = 0.2;

// Over the longer side: from the widest lens without a fish eye's bend to a long tele.
constexpr double kShortestFocal = 0.25, kLongestFocal = 20;

Camera CentredCamera(double focal_px, const cv::Size& size) {
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.pinhole = {focal_px, focal_px, (size.width - 1) / 2.0, (size.height - 1) / 2.0};
  return camera;
}

bool CanBeFocal(double focal_px, const cv::Size& size) {
  const double over_side = focal_px / std::max(size.width, size.height);
  return over_side >= kShortestFocal && over_side <= kLongestFocal;
}

/// How much smaller the photograph is than the camera wrote it: the optical centre is else near its
/// middle.
double ScaleSince(const XmpLens& xmp, const cv::Size& size) {
  if (!xmp.cx_px || *xmp.cx_px <= 0) return 1;
  const double ratio = size.width / (2 * *xmp.cx_px);
  return std::abs(ratio - 1) > kNearMiddle ? ratio : 1;
}

std::optional<FoundCamera> CameraFromXmp(const XmpLens& xmp, const cv::Size& size) {
  const double scale = ScaleSince(xmp, size);
  if (!CanBeFocal(scale * xmp.focal_px, size)) return std::nullopt;
  FoundCamera found{CentredCamera(scale * xmp.focal_px, size), {"XMP calibrated", kSigmaXmp}};
  if (!xmp.cx_px || !xmp.cy_px) return found;
  const double cx = scale * (*xmp.cx_px + 0.5) - 0.5, cy = scale * (*xmp.cy_px + 0.5) - 0.5;
  const bool near_middle = std::abs(cx - size.width / 2.0) < kNearMiddle * size.width &&
                           std::abs(cy - size.height / 2.0) < kNearMiddle * size.height;
  if (near_middle) found.camera.pinhole.cx = cx, found.camera.pinhole.cy = cy;
  return found;
}

double FactorAt(const std::array<double, 6>& k, double r2) {
  return (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[2]))) / (1 + r2 * (k[3] + r2 * (k[4] + r2 * k[5])));
}

/// k1 and k2 alone that come nearest to all of `radial` over an image whose corner appears at
/// `corner_radius` (over the focal length): photographs refine these. Each ring counts by its area.
/// Nothing of a lens that is not one-to-one as far as there.
std::optional<Eigen::Vector2d> PlainRadialOf(const std::array<double, 6>& radial,
                                             double corner_radius) {
  constexpr double kStep = 0.005, kMostTimes = 4;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double last = 0;
  for (double r = kStep * corner_radius; last < corner_radius; r += kStep * corner_radius) {
    const double appears_at = r * FactorAt(radial, r * r);
    if (!(appears_at > last) || r > kMostTimes * corner_radius) return std::nullopt;
    const Eigen::Vector2d row(std::pow(r, 3), std::pow(r, 5));
    const double area = appears_at * (appears_at - last);
    normal += area * row * row.transpose();
    right += area * row * (appears_at - r);
    last = appears_at;
  }
  return normal.ldlt().solve(right);
}

bool AreNear(double a, double b, double share) { return std::abs(a - b) <= share * std::abs(b); }

/// Nothing where what is said cannot be, or EXIF says another lens.
std::optional<FoundCamera> CameraFromMeasured(const XmpLens& xmp, const PhotoExif& exif,
                                              const cv::Size& size) {
  const MeasuredLens& lens = *xmp.measured;
  constexpr double kSquarePixels = 0.05, kSameLens = 0.25;
  if (!(lens.fx > 0) || !AreNear(lens.fy, lens.fx, kSquarePixels)) return std::nullopt;
  if (lens.in_mm && !exif.sensor_width_mm) return std::nullopt;
  const double scale = lens.in_mm ? size.width / *exif.sensor_width_mm : ScaleSince(xmp, size);
  const double focal_px = scale * (lens.fx + lens.fy) / 2;
  if (!CanBeFocal(focal_px, size)) return std::nullopt;
  const auto by_exif = FocalLengthPx(exif, size.width, size.height);
  if (by_exif && !AreNear(*by_exif, focal_px, kSameLens)) return std::nullopt;
  const Eigen::Vector2d middle(size.width / 2.0, size.height / 2.0);
  Eigen::Vector2d offset_px = scale * lens.centre;
  if (lens.is_centre_from_corner) offset_px -= middle;
  if (!((offset_px.array().abs() < 2 * kNearMiddle * middle.array()).all())) return std::nullopt;
  // Of each one alone only DJI says so, and how large the image was that it is of.
  const bool is_own = !lens.in_mm && !lens.is_undone && xmp.cx_px;
  FoundCamera found{CentredCamera(focal_px, size), {"XMP calibrated", kSigmaXmp}};
  if (is_own) found.source = {"XMP measured", kSigmaMeasured};
  if (lens.is_undone) return found;
  found.camera.pinhole.cx += offset_px.x();
  found.camera.pinhole.cy += offset_px.y();
  const Eigen::Vector2d farthest = middle + offset_px.cwiseAbs();
  const auto plain = PlainRadialOf(lens.radial, farthest.norm() / focal_px);
  if (!plain) return std::nullopt;
  found.camera.lens = LensModel::kRadialTangential;
  found.camera.distortion = {plain->x(), plain->y(), 0, 0};
  try {
    found.camera.Check("XMP");
  } catch (const Error&) {
    return std::nullopt;
  }
  return found;
}

}  // namespace

CalibrationSource CalibrationByHand() { return {"camera.yaml, model auto", kSigmaByHand}; }

std::optional<FoundCamera> CameraFromMetadata(const std::optional<XmpLens>& xmp,
                                              const PhotoExif& exif, const cv::Size& size) {
  if (xmp && xmp->measured) {
    if (auto found = CameraFromMeasured(*xmp, exif, size)) return found;
  }
  if (xmp) {
    if (auto found = CameraFromXmp(*xmp, size)) return found;
  }
  const auto focal = FocalLengthPx(exif, size.width, size.height);
  if (!focal || !CanBeFocal(*focal, size)) return std::nullopt;
  const char* source = exif.focal_length_35mm ? "EXIF 35 mm equivalent" : "EXIF focal length";
  return FoundCamera{CentredCamera(*focal, size), {source, kSigmaExif}};
}

FoundCamera GuessedCamera(const cv::Size& size) {
  constexpr double kFocalOverSide = 0.83;
  return {CentredCamera(kFocalOverSide * std::max(size.width, size.height), size),
          {"a guess", kSigmaGuess}};
}

Camera CameraForSize(const Camera& camera, const cv::Size& size, const std::string& image,
                     const std::string& file) {
  if (camera.width == size.width && camera.height == size.height) return camera;
  const double x = static_cast<double>(size.width) / camera.width;
  const double y = static_cast<double>(size.height) / camera.height;
  constexpr double kSameProportions =
      0.01;  // sizes are rounded to whole pixels, often to even ones
  if (std::abs(x / y - 1) > kSameProportions) {
    throw Error("{}: image is {}x{}: expected {}x{} as in {}, or the same proportions", image,
                size.width, size.height, camera.width, camera.height, file);
  }
  return ScaledCamera(camera, size.width, size.height);
}

}  // namespace deepuav
