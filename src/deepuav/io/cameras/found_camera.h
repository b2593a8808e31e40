#pragma once

#include <opencv2/core/types.hpp>
#include <optional>
#include <string>

#include "deepuav/geometry/camera.h"
#include "deepuav/io/cameras/exif.h"
#include "deepuav/io/cameras/xmp_lens.h"
#include "deepuav/io/datasets/dataset.h"

namespace deepuav {

/// A camera and where it is from.
struct FoundCamera {
  Camera camera;
  CalibrationSource source;
};

/// How far a `camera.yaml` of `model: auto` is trusted.
CalibrationSource CalibrationByHand();

/// The camera of photographs of that size by the first that tells of: XMP's lens as measured, as
/// designed, EXIF's 35 mm equivalent, EXIF's focal length with the sensor's width; nothing where
/// none does.
std::optional<FoundCamera> CameraFromMetadata(const std::optional<XmpLens>& xmp,
                                              const PhotoExif& exif, const cv::Size& size);

/// A lens as drones and action cameras mostly have, where nothing is known: 62 degrees across.
FoundCamera GuessedCamera(const cv::Size& size);

/// The calibration of `file`, made for images of another size, for those of `size`. Throws Error
/// naming `image` and the file unless both have the same proportions.
Camera CameraForSize(const Camera& camera, const cv::Size& size, const std::string& image,
                     const std::string& file);

}  // namespace deepuav
