#include "deepuav/image/image.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "deepuav/base/error.h"
#include "deepuav/base/input_file.h"
#include "deepuav/base/logging.h"
#include "deepuav/image/encoded_size.h"
#include "deepuav/image/partial_jpeg.h"
#include "deepuav/image/reduced_image.h"

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

bool IsTruncatedPng(const Bytes& bytes) {
  return StartsWith(bytes, kPngSignature) && !IsWholePng(bytes);
}

// Fewer rows show too little of the ground.
constexpr double kMinDecodedShare = 0.75;

/// How far a JPEG of `from` may be reduced by its decoder and still be as large as `to`.
int DecoderReduction(const cv::Size2d& from, const cv::Size& to) {
  for (const int factor : {8, 4, 2}) {
    if (from.width / factor >= to.width && from.height / factor >= to.height) return factor;
  }
  return 1;
}

int ReadMode(int reduction, JpegColours colours) {
  const bool is_grey = colours == JpegColours::kGrey;
  switch (reduction) {
    case 8:
      return is_grey ? cv::IMREAD_REDUCED_GRAYSCALE_8 : cv::IMREAD_REDUCED_COLOR_8;
    case 4:
      return is_grey ? cv::IMREAD_REDUCED_GRAYSCALE_4 : cv::IMREAD_REDUCED_COLOR_4;
    case 2:
      return is_grey ? cv::IMREAD_REDUCED_GRAYSCALE_2 : cv::IMREAD_REDUCED_COLOR_2;
    default:
      return (is_grey ? cv::IMREAD_GRAYSCALE : cv::IMREAD_COLOR) | cv::IMREAD_ANYDEPTH;
  }
}

/// The value that `share` of the finite pixels are below, from a sorted sample of them.
float Percentile(const std::vector<float>& sorted, double share) {
  return sorted[static_cast<size_t>(share * static_cast<double>(sorted.size() - 1))];
}

GreyImage StretchTo8Bit(const cv::Mat& deep, const std::string& name) {
  if (deep.depth() == CV_8U) return deep;
  cv::Mat1f values;
  deep.convertTo(values, CV_32F);
  constexpr size_t kSample = 100000;
  const size_t step = std::max<size_t>(1, values.total() / kSample);
  std::vector<float> sample;
  for (size_t i = 0; i < values.total(); i += step) {
    const float value =
        values.at<float>(static_cast<int>(i) / values.cols, static_cast<int>(i) % values.cols);
    if (std::isfinite(value)) sample.push_back(value);
  }
  if (sample.empty()) throw Error("image {}: holds no finite value: expected a picture", name);
  std::sort(sample.begin(), sample.end());
  constexpr double kCutShare = 0.01;
  float low = Percentile(sample, kCutShare), high = Percentile(sample, 1 - kCutShare);
  // A photograph of 16 bits that uses them is none of a thermal camera.
  constexpr float kWhole = 65535, kMinUsed = 0.25;
  if (deep.depth() == CV_16U && high - low >= kMinUsed * kWhole) low = 0, high = kWhole;
  const double gain = high > low ? 255.0 / (high - low) : 0;
  cv::patchNaNs(values, low);
  GreyImage grey;
  values.convertTo(grey, CV_8U, gain, -gain * low);
  return grey;
}

/// What OpenCV makes of the bytes; throws Error where that is nothing.
cv::Mat DecodeWhole(const Bytes& bytes, const std::string& name, int reduction,
                    JpegColours colours) {
  try {
    // Calibrations are in the sensor's pixels, so the orientation in the EXIF data must not turn
    // the image.
    cv::Mat image =
        cv::imdecode(bytes, ReadMode(reduction, colours) | cv::IMREAD_IGNORE_ORIENTATION);
    if (!image.empty()) return image;
  } catch (const cv::Exception& exception) {
    throw Error("image {}: cannot be decoded ({}): expected an image", name, exception.err);
  }
  throw Error("image {}: cannot be decoded: expected an image that OpenCV reads", name);
}

/// A JPEG without its end, as far as it goes.
PartialJpeg DecodeBrokenOff(const Bytes& bytes, const std::string& name, int reduction,
                            JpegColours colours) {
  const auto partial = DecodePartialJpeg(bytes, reduction, colours);
  if (!partial || partial->decoded_share < kMinDecodedShare) {
    throw Error("image {}: breaks off after {} bytes: expected a whole image", name, bytes.size());
  }
  Log().warn("image {}: breaks off after {} bytes: {:.0f} % of its rows are used", name,
             bytes.size(), 100 * partial->decoded_share);
  return *partial;
}

Bytes ReadImageFile(const std::filesystem::path& file) {
  RefuseNamedPipe(file);
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream || std::filesystem::is_directory(file)) {
    throw Error("image {}: cannot be opened: expected a readable image file", file.string());
  }
  const auto length = static_cast<int64_t>(stream.tellg());
  if (length > kMaxBytes) {
    throw Error("image {}: has {} bytes: expected at most {}", file.string(), length, kMaxBytes);
  }
  Bytes bytes(static_cast<size_t>(std::max<int64_t>(length, 0)));
  stream.seekg(0);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()),
                   static_cast<std::streamsize>(bytes.size()))) {
    throw Error("image {}: cannot be read: expected {} bytes", file.string(), bytes.size());
  }
  return bytes;
}

/// Not smaller than `size`, where that is not empty and the image is not.
PartialJpeg Decode(const Bytes& bytes, const std::string& name, const cv::Size& size,
                   JpegColours colours) {
  if (bytes.empty()) throw Error("image {}: is empty: expected an image", name);
  const bool is_jpeg = StartsWith(bytes, kJpegSignature);
  if (IsTruncatedPng(bytes)) {
    throw Error("image {}: breaks off after {} bytes: expected a whole image", name, bytes.size());
  }
  const auto encoded = EncodedSize(bytes);
  if (encoded && encoded->area() > kMaxPixels) {
    throw Error("image {}: is {:.0f}x{:.0f}: expected at most {:.0f} pixels", name, encoded->width,
                encoded->height, kMaxPixels);
  }
  const int reduction = is_jpeg && encoded && !size.empty() ? DecoderReduction(*encoded, size) : 1;
  if (is_jpeg && !IsWholeJpeg(bytes)) return DecodeBrokenOff(bytes, name, reduction, colours);
  return {DecodeWhole(bytes, name, reduction, colours), 1};
}

}  // namespace

GreyImage LoadGrey(const std::filesystem::path& file) { return LoadReducedGrey(file, {}); }

GreyImage DecodeGrey(const std::vector<uint8_t>& bytes, const std::string& name) {
  return DecodeReducedGrey(bytes, name, {});
}

GreyImage LoadReducedGrey(const std::filesystem::path& file, const cv::Size& size) {
  return DecodeReducedGrey(ReadImageFile(file), file.string(), size);
}

GreyImage DecodeReducedGrey(const std::vector<uint8_t>& bytes, const std::string& name,
                            const cv::Size& size) {
  GreyImage grey = StretchTo8Bit(Decode(bytes, name, size, JpegColours::kGrey).image, name);
  if (size.empty() || grey.size() == size) return grey;
  GreyImage reduced;
  cv::resize(grey, reduced, size, 0, 0, cv::INTER_AREA);
  return reduced;
}

cv::Mat3b LoadReducedColour(const std::filesystem::path& file, const cv::Size& size) {
  const Bytes bytes = ReadImageFile(file);
  PartialJpeg decoded = Decode(bytes, file.string(), size, JpegColours::kBlueGreenRed);
  if (decoded.image.depth() != CV_8U) {
    cv::Mat3b colour;
    cv::cvtColor(DecodeReducedGrey(bytes, file.string(), size), colour, cv::COLOR_GRAY2BGR);
    return colour;
  }
  if (!size.empty() && decoded.image.size() != size)
    cv::resize(decoded.image, decoded.image, size, 0, 0, cv::INTER_AREA);
  return decoded.image.rowRange(
      0, static_cast<int>(std::floor(decoded.decoded_share * decoded.image.rows)));
}

}  // namespace deepuav
