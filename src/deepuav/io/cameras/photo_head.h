#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace deepuav {

/// What a photograph's file says of itself beside its pixels.
class PhotoHead {
 public:
  /// Throws Error naming the file when it cannot be read.
  explicit PhotoHead(const std::filesystem::path& file);

  /// What ParseExif takes.
  std::span<const uint8_t> exif() const {
    return {reinterpret_cast<const uint8_t*>(exif_.data()), exif_.size()};
  }
  /// Text that holds its XMP, where there is some.
  std::string_view xmp() const { return xmp_ ? *xmp_ : exif_; }

 private:
  std::string exif_;
  std::optional<std::string> xmp_;  ///< Where it lies apart.
};

}  // namespace deepuav
