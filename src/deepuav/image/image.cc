#include "deepuav/image/image.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/image/encoded_size.h"

namespace deepuav {
namespace {

using Bytes = std::vector<uint8_t>;

// Beyond any camera: a damaged header that claims more would only exhaust the memory.
constexpr double kMaxPixels = 200e6;
constexpr int64_t kMaxBytes = int64_t{1} << 30;

size_t BigEndian(const Bytes& bytes, size_t at, int count) {
  size_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | bytes[at + i];
  return value;
}

bool StartsWith(const Bytes& bytes, std::string_view signature) {
  return bytes.size() >= signature.size() &&
         std::memcmp(bytes.data(), signature.data(), signature.size()) == 0;
}

constexpr std::string_view kJpegSignature = "\xff\xd8\xff";
constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";

// Walks the segments of the main image (ITU-T T.81, annex B) to its end marker. A search for the
// marker alone would find those of embedded thumbnails.
bool IsWholeJpeg(const Bytes& bytes) {
  constexpr uint8_t kMarker = 0xff, kStuffed = 0x00, kTemporary = 0x01, kRestart0 = 0xd0,
                    kRestart7 = 0xd7;
  constexpr uint8_t kEndOfImage = 0xd9, kStartOfScan = 0xda;
  bool in_scan = false;
  for (size_t at = 2; at + 1 < bytes.size();) {
    const uint8_t code = bytes[at + 1];
    if (bytes[at] != kMarker ||
        code == kMarker) {  // picture data, damage between segments, or fill
      ++at;
    } else if (code == kEndOfImage) {
      return true;
    } else if (code == kTemporary || (code >= kRestart0 && code <= kRestart7) ||
               (in_scan && code == kStuffed)) {
      at += 2;
    } else {
      if (at + 3 >= bytes.size()) return false;
      at += 2 + BigEndian(bytes, at + 2, 2);
      in_scan = code == kStartOfScan;
    }
  }
  return false;
}

bool IsWholePng(const Bytes& bytes) {
  constexpr size_t kLengthAndType = 8, kChecksum = 4;
  for (size_t at = kPngSignature.size(); at + kLengthAndType + kChecksum <= bytes.size();) {
    if (std::memcmp(&bytes[at + 4], "IEND", 4) == 0) return true;
    at += kLengthAndType + BigEndian(bytes, at, 4) + kChecksum;
  }
  return false;
}

// OpenCV fills what is missing of these formats with grey and only warns.
bool IsTruncated(const Bytes& bytes) {
  if (StartsWith(bytes, kJpegSignature)) return !IsWholeJpeg(bytes);
  if (StartsWith(bytes, kPngSignature)) return !IsWholePng(bytes);
  return false;
}

}  // namespace

GreyImage LoadGrey(const std::filesystem::path& file) {
  RefuseNamedPipe(file);
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream || std::filesystem::is_directory(file)) {
    throw Error("image {}: cannot be opened: expected a readable image file", file.string());
  }
  const auto size = static_cast<int64_t>(stream.tellg());
  if (size > kMaxBytes) {
    throw Error("image {}: has {} bytes: expected at most {}", file.string(), size, kMaxBytes);
  }
  Bytes bytes(static_cast<size_t>(std::max<int64_t>(size, 0)));
  stream.seekg(0);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()),
                   static_cast<std::streamsize>(bytes.size()))) {
    throw Error("image {}: cannot be read: expected {} bytes", file.string(), bytes.size());
  }
  return DecodeGrey(bytes, file.string());
}

GreyImage DecodeGrey(const std::vector<uint8_t>& bytes, const std::string& name) {
  if (bytes.empty()) throw Error("image {}: is empty: expected an image", name);
  if (IsTruncated(bytes)) {
    throw Error("image {}: breaks off after {} bytes: expected a whole image", name, bytes.size());
  }
  if (const auto size = EncodedSize(bytes); size && size->area() > kMaxPixels) {
    throw Error("image {}: is {:.0f}x{:.0f}: expected at most {:.0f} pixels", name, size->width,
                size->height, kMaxPixels);
  }
  cv::Mat image;
  try {
    // Calibrations are in the sensor's pixels, so the orientation in the EXIF data must not turn
    // the image.
    image = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& exception) {
    throw Error("image {}: cannot be decoded ({}): expected an image", name, exception.err);
  }
  if (image.empty())
    throw Error("image {}: cannot be decoded: expected an image that OpenCV reads", name);
  return image;
}

}  // namespace deepuav
