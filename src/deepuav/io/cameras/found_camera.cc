#include "deepuav/io/cameras/found_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "deepuav/base/error.h"
#include "deepuav/geometry/camera_scale.h"

namespace deepuav {
namespace {

// Standard deviations of the focal length over it. EXIF gives whole millimetres, of a lens whose
// crop by stabilisation and video modes it leaves out.
constexpr double kSigmaByHand = 0.1, kSigmaXmp = 0.03, kSigmaExif = 0.1, kSigmaGuess = 0.5;

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

std::optional<FoundCamera> CameraFromXmp(const XmpLens& xmp, const cv::Size& size) {
  // The optical centre lies near the middle: where it does not, the photograph was resized after
  // the camera wrote it.
  constexpr double kNearMiddle = 0.2;
  double scale = 1;
  if (xmp.cx_px && *xmp.cx_px > 0) {
    const double ratio = size.width / (2 * *xmp.cx_px);
    if (std::abs(ratio - 1) > kNearMiddle) scale = ratio;
  }
  if (!CanBeFocal(scale * xmp.focal_px, size)) return std::nullopt;
  FoundCamera found{CentredCamera(scale * xmp.focal_px, size), {"XMP calibrated", kSigmaXmp}};
  if (!xmp.cx_px || !xmp.cy_px) return found;
  const double cx = scale * (*xmp.cx_px + 0.5) - 0.5, cy = scale * (*xmp.cy_px + 0.5) - 0.5;
  const bool near_middle = std::abs(cx - size.width / 2.0) < kNearMiddle * size.width &&
                           std::abs(cy - size.height / 2.0) < kNearMiddle * size.height;
  if (near_middle) found.camera.pinhole.cx = cx, found.camera.pinhole.cy = cy;
  return found;
}

}  // namespace

CalibrationSource CalibrationByHand() { return {"camera.yaml, model auto", kSigmaByHand}; }

std::optional<FoundCamera> CameraFromMetadata(const std::optional<XmpLens>& xmp,
                                              const PhotoExif& exif, const cv::Size& size) {
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
