#include "deepuav/io/cameras/photo_head.h"

#include <utility>

#include "deepuav/io/cameras/tiff_metadata.h"
#include "deepuav/io/files/text_file.h"

namespace deepuav {

PhotoHead::PhotoHead(const std::filesystem::path& file) {
  // EXIF, XMP, thumbnail and what makers add.
  constexpr size_t kHeadBytes = size_t{512} << 10;
  exif_ = ReadHead(file, kHeadBytes);
  if (!exif_.starts_with("II") && !exif_.starts_with("MM")) return;
  if (auto tiff = ReadTiffMetadata(file)) {
    xmp_ = tiff->xmp.empty() ? std::move(exif_) : std::move(tiff->xmp);
    exif_ = std::move(tiff->exif);
  }
}

}  // namespace deepuav
