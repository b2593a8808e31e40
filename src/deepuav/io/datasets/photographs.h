#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "deepuav/io/cameras/exif.h"
#include "deepuav/io/cameras/xmp.h"
#include "deepuav/io/cameras/xmp_lens.h"
#include "deepuav/sensors/samples.h"

namespace deepuav {

/// What the file of a photograph says of itself before its pixels.
struct Photograph {
  std::filesystem::path file;
  PhotoExif exif;
  std::optional<XmpLens> xmp;
  std::string band;            ///< Of a camera that takes one of several at once.
  std::optional<GnssFix> fix;  ///< By the best of what the file says.
  std::optional<Eigen::Quaterniond> enu_from_cam;
  std::optional<cv::Size> size;  ///< Nothing where it cannot be read.
};

/// Those in the folder and below it, hidden ones left out, by name, numbers in it by their value:
/// IMG_9 before IMG_10. Files that cannot be read are logged, and have no size.
std::vector<Photograph> ListPhotographs(const std::filesystem::path& images);

}  // namespace deepuav
