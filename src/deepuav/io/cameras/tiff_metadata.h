#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace deepuav {

/// What a TIFF says of its first picture.
struct TiffMetadata {
  std::string exif;  ///< A small TIFF of its camera, EXIF and GPS, in the file's byte order.
  std::string xmp;
};

/// Wherever in the file it lies: many writers put it behind the pixels. Nothing of a file that is
/// no TIFF of 32 bits, or whose directory cannot be; parts that cannot be are left out. Throws
/// Error naming the file when it cannot be read.
std::optional<TiffMetadata> ReadTiffMetadata(const std::filesystem::path& file);

}  // namespace deepuav
