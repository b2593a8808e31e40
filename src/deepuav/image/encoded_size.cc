#include "deepuav/image/encoded_size.h"

#include <cmath>
#include <cstring>
#include <string_view>

namespace deepuav {
namespace {

using namespace std::string_view_literals;

/// Reads numbers of one byte order; 0 beyond the end.
struct Reader {
  std::span<const uint8_t> bytes;
  bool big_endian = true;

  uint32_t Number(size_t at, size_t count) const {
    if (at > bytes.size() || count > bytes.size() - at) return 0;
    uint32_t value = 0;
    for (size_t i = 0; i < count; ++i)
      value = value << 8 | bytes[at + (big_endian ? i : count - 1 - i)];
    return value;
  }
};

bool StartsWith(std::span<const uint8_t> bytes, std::string_view mark) {
  return bytes.size() >= mark.size() && std::memcmp(bytes.data(), mark.data(), mark.size()) == 0;
}

std::optional<cv::Size2d> SizeOf(double width, double height) {
  if (width == 0 || height == 0) return std::nullopt;
  return cv::Size2d(width, height);
}

// The frame header (ITU-T T.81, B.2.2): SOF0 to SOF15 but for the codes between that mean other
// things.
std::optional<cv::Size2d> JpegSize(const Reader& reader) {
  for (size_t at = 2; at + 4 <= reader.bytes.size();) {
    const uint32_t mark = reader.Number(at, 1), code = reader.Number(at + 1, 1);
    if (mark != 0xff || code == 0xff) {
      ++at;
      continue;
    }
    const bool is_frame =
        code >= 0xc0 && code <= 0xcf && code != 0xc4 && code != 0xc8 && code != 0xcc;
    if (is_frame) return SizeOf(reader.Number(at + 7, 2), reader.Number(at + 5, 2));
    const bool has_length = code > 0x01 && (code < 0xd0 || code > 0xd9);
    at += 2 + (has_length ? reader.Number(at + 2, 2) : 0);
  }
  return std::nullopt;
}

// The first directory (TIFF 6.0, section 2): ImageWidth 256, ImageLength 257, as SHORT or LONG.
std::optional<cv::Size2d> TiffSize(const Reader& reader) {
  constexpr uint32_t kWidthTag = 256, kHeightTag = 257, kShort = 3;
  constexpr size_t kEntryBytes = 12;
  const size_t directory = reader.Number(4, 4);
  const uint32_t count = reader.Number(directory, 2);
  double width = 0, height = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const size_t entry = directory + 2 + kEntryBytes * i;
    const uint32_t tag = reader.Number(entry, 2);
    const double value = reader.Number(entry + 8, reader.Number(entry + 2, 2) == kShort ? 2 : 4);
    if (tag == kWidthTag) width = value;
    if (tag == kHeightTag) height = value;
  }
  return SizeOf(width, height);
}

// BITMAPINFOHEADER; a negative height says that the rows run downwards.
std::optional<cv::Size2d> BmpSize(const Reader& reader) {
  return SizeOf(std::abs(static_cast<double>(static_cast<int32_t>(reader.Number(18, 4)))),
                std::abs(static_cast<double>(static_cast<int32_t>(reader.Number(22, 4)))));
}

// The first chunk (WebP container specification; RFC 6386, 9.1; lossless bitstream, 3).
std::optional<cv::Size2d> WebpSize(const Reader& reader) {
  const std::span<const uint8_t> chunk = reader.bytes.subspan(12);
  constexpr uint32_t k14Bits = 0x3fff;
  if (StartsWith(chunk, "VP8X"))
    return SizeOf(reader.Number(24, 3) + 1.0, reader.Number(27, 3) + 1.0);
  if (StartsWith(chunk, "VP8L")) {
    const uint32_t bits = reader.Number(21, 4);
    return SizeOf((bits & k14Bits) + 1.0, (bits >> 14 & k14Bits) + 1.0);
  }
  if (StartsWith(chunk, "VP8 "))
    return SizeOf(reader.Number(26, 2) & k14Bits, reader.Number(28, 2) & k14Bits);
  return std::nullopt;
}

}  // namespace

std::optional<cv::Size2d> EncodedSize(std::span<const uint8_t> bytes) {
  if (StartsWith(bytes, "\xff\xd8\xff")) return JpegSize({bytes});
  if (StartsWith(bytes, "\x89PNG\r\n\x1a\n")) {
    const Reader reader{bytes};
    return SizeOf(reader.Number(16, 4), reader.Number(20, 4));
  }
  if (StartsWith(bytes, "II*\0"sv)) return TiffSize({bytes, false});
  if (StartsWith(bytes, "MM\0*"sv)) return TiffSize({bytes, true});
  if (StartsWith(bytes, "BM") && bytes.size() >= 26) return BmpSize({bytes, false});
  if (StartsWith(bytes, "RIFF") && bytes.size() >= 30 && StartsWith(bytes.subspan(8), "WEBP"))
    return WebpSize({bytes, false});
  return std::nullopt;
}

}  // namespace deepuav
