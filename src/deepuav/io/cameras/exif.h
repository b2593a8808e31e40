#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "deepuav/base/time.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

/// What a photograph's EXIF says of when, where and with what lens it was taken. What is absent or
/// cannot be is empty.
struct PhotoExif {
  std::optional<Timestamp>
      time;  ///< DateTimeOriginal and SubSecTimeOriginal, the camera's clock read as UTC.
  std::optional<GnssFix> fix;  ///< Without a time of its own.
  std::string camera_model;
  std::optional<double> focal_length_mm;
  std::optional<double> focal_length_35mm;  ///< Of a view as wide on film of 36 x 24 mm.
  bool is_turned = false;  ///< The picture is to be shown turned or mirrored (Orientation).
  std::optional<double> sensor_width_mm;  ///< By FocalPlaneXResolution and PixelXDimension.
};

/// Whether a fix can be one: no angle beyond its range, and nothing within a minute of where the
/// equator meets the prime meridian, which some cameras write where they had no fix.
bool IsPlaceOnEarth(const GnssFix& fix);

/// Reads the EXIF of the first bytes of a JPEG, PNG or TIFF file; no EXIF is no error.
PhotoExif ParseExif(std::span<const uint8_t> bytes);

/// The focal length in px of an image: by the 35 mm equivalent, else by the focal length and the
/// sensor's width as given or as known for the camera's model. The equivalent is by the diagonal
/// (CIPA DCG-001), for images wider than 3:2, which are cut from such, by the width.
std::optional<double> FocalLengthPx(const PhotoExif& exif, int width_px, int height_px);

}  // namespace deepuav
