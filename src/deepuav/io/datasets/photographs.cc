#include "deepuav/io/datasets/photographs.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/logging.h"
#include "deepuav/io/cameras/photo_head.h"
#include "deepuav/io/datasets/image_file_dataset.h"

namespace deepuav {
namespace {

namespace fs = std::filesystem;

/// Many cameras write altitudes from another origin, or the barometer's.
constexpr double kAltitudeSigma_m = 10;

std::optional<GnssFix> FixOf(const PhotoExif& exif, std::string_view xmp) {
  std::optional<GnssFix> fix = ParseXmpRtkFix(xmp);
  if (!fix) {
    fix = exif.fix;
    if (!fix) return fix;
    const Eigen::Vector3d accuracy_m = ParseXmpAccuracy_m(xmp);
    if (accuracy_m.x() > 0) fix->sigma_m = accuracy_m;
  }
  if (fix->sigma_m.z() == 0) fix->sigma_m.z() = kAltitudeSigma_m;
  return fix;
}

/// What the file says of itself before its pixels.
void ReadHeader(Photograph* photograph) {
  try {
    const PhotoHead head(photograph->file);
    photograph->exif = ParseExif(head.exif());
    photograph->xmp = ParseXmpLens(head.xmp());
    photograph->band = ParseXmpBand(head.xmp());
    photograph->fix = FixOf(photograph->exif, head.xmp());
    // Whether angles are of the picture as stored or as shown is not said.
    if (!photograph->exif.is_turned) photograph->enu_from_cam = ParseXmpAttitude(head.xmp());
    photograph->size = StoredSize(photograph->file);
  } catch (const Error& error) {  // Load() will say so again, when the frame's turn comes.
    Log().warn("{}", error.what());
  }
}

bool IsHidden(const fs::path& file, const fs::path& below) {
  const fs::path relative = file.lexically_relative(below);
  return std::any_of(relative.begin(), relative.end(),
                     [](const fs::path& part) { return part.string().starts_with('.'); });
}

}  // namespace

std::vector<Photograph> ListPhotographs(const fs::path& images) {
  std::vector<Photograph> photographs;
  for (const auto& entry :
       fs::recursive_directory_iterator(images, fs::directory_options::skip_permission_denied)) {
    const fs::path& file = entry.path();
    if (IsImageFileName(file) && !IsHidden(file, images) && !entry.is_directory())
      photographs.push_back({.file = file,
                             .exif = {},
                             .xmp = {},
                             .band = {},
                             .fix = {},
                             .enu_from_cam = {},
                             .size = {}});
  }
  std::sort(photographs.begin(), photographs.end(), [](const Photograph& a, const Photograph& b) {
    return ::strverscmp(a.file.c_str(), b.file.c_str()) < 0;
  });
  for (Photograph& photograph : photographs) ReadHeader(&photograph);
  return photographs;
}

}  // namespace deepuav
